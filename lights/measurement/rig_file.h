// The description of a virtual measurement: the rig, the lamp in front of it, and its camera.
//
// Users write it as TOML; docs/reference/rig-files.md is its reference. Lengths are checked here; files that
// it names (a slide, a scene) are read by the acquisition.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"
#include "engine/system/hash.h"
#include "engine/system/toml.h"
#include "lights/light_field.h"
#include "lights/measurement/acquire.h"

namespace lucerna {

// The camera of a rig, which turns irradiance on a sensor into the counts of a photograph.
//
// A pixel collects electrons in proportion to irradiance and time, plus a dark current, with shot noise and
// read noise. It saturates at `full_well`, and its value is rounded to the steps of its bits. A series of
// exposures covers a larger range than a single one.

struct CameraModel {
    std::vector<double> exposures{1};  // seconds, ascending, all > 0
    int bits = 16;                     // of a count, 8 to 16; 32: floats, neither rounded nor clipped
    double full_well = 50000;          // electrons at which a pixel is full
    double read_noise = 0;             // electrons, standard deviation
    bool shot_noise = false;           // the number of electrons is a Poisson variable
    double dark_current = 0;           // electrons per second and pixel
    double hot_pixels = 0;             // share of the pixels with hot_factor times the dark current
    double hot_factor = 100;
    // Electrons per (flux unit / m²) and second. 0: the brightest pixel of all views fills the share `fill`
    // of the well in the shortest exposure.
    double sensitivity = 0;
    double fill = 0.8;
    std::uint64_t seed = 1;
    // Photographs may be finer than M: sensor pixels per pixel of M and axis, and a margin around them, in
    // sensor pixels, that is to be cropped.
    V2i oversampling{1, 1};
    V2i margin{0, 0};
    // For Setup B, a pinhole that looks at the back of the screen, in metres in the rig's frame (S at z = 0,
    // the screen at z = D), and the size of the photograph. z = 0 stands for straight behind the screen, far
    // enough.
    Imath::V3d place{0, 0, 0};
    V2i photograph{0, 0};  // pixels; 0: oversampling times M's
    // Counts without light; if negative, six deviations of the read noise, so that noise is not clipped at
    // black.
    double pedestal = -1;
    int darks = 4;               // dark photographs per exposure time
    std::string format = "png";  // png, tiff, or exr for floats
};

// Reads the table [camera]; missing values keep the defaults above. Throws InputError naming line and column.
CameraModel read_camera(const TomlTable& table);

// The parameters of a lamp. Lengths are in metres.
struct EmitterDescription {
    enum class Kind : std::uint8_t { disc, rectangle, projector, scene } kind = Kind::disc;
    double setback = 0;  // of its plane behind S; for a scene, of its z = 0
    double flux = 1;     // total, in `unit`; for a scene 0: as its lights have it
    FluxUnit unit = FluxUnit::lumen;
    Rgb colour{1.0F};  // luminance 1; for a projector, of the light behind its slide

    // Disc and rectangle: intensity ∝ cos^exponent θ.
    V2d half_size{0, 0};  // for a disc, both are the radius; for a projector, the lens's
    double exponent = 1;
    std::optional<Rgb> rim_colour, grazing_colour;  // luminance 1: ColourCourse

    // Projector.
    double focal_length = 0;
    double focus = 0;             // from the lens to the plane in focus, > focal_length
    V2d slide_size{0, 0};         // of the slide itself
    bool inverted = false;        // the slide transmits 1 - its picture
    std::filesystem::path slide;  // a picture

    // Scene.
    std::filesystem::path scene;
    std::int64_t rays = 20'000'000;
    std::uint64_t seed = 0;
};

struct RigDescription {
    Rig rig;
    EmitterDescription emitter;
    AcquireOptions quality;
    std::optional<CameraModel> camera;
};

// Throw InputError naming file, line and column.
RigDescription read_rig_file(const std::filesystem::path& file);
RigDescription read_rig(const TomlTable& table);

// Read parts of it for other descriptions of measurements: the table [rig], and the key "colour" (white if
// there is none).
Rig read_planes(const TomlTable& table);
Rgb read_colour(const TomlTable& table, std::string_view key = "colour");

// Adds all numbers of a rig to the hash.
void add(WordHash& hash, const Rig& rig);

// Returns a hash of all numbers of a description; the files that it names enter by their names only.
std::uint64_t description_key(const RigDescription& description);

}  // namespace lucerna
