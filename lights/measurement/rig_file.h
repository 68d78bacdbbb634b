// The description of a virtual measurement: the rig, the lamp that stands before it, and its camera.
//
// People write it as TOML; docs/reference/rig-files.md is its reference. What can be said with lengths alone
// is checked here; files that it names (a slide, a scene) are read by whoever measures.
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

// The camera of a rig: what turns irradiance on a sensor into the numbers of a photograph.
//
// A pixel collects electrons in proportion to irradiance and time, and a dark current on top; it counts them
// with shot noise and with the noise of reading out; it is full at `full_well`; and what it has collected is
// written in whole steps of its bits. A series of exposures covers more range than one can.

struct CameraModel {
    std::vector<double> exposures{1};  // seconds, rising, all > 0
    int bits = 16;  // of a number in a photograph, 8 to 16; 32: floats, neither rounded nor clipped
    double full_well = 50000;  // electrons at which a pixel is full
    double read_noise = 0;     // electrons, standard deviation
    bool shot_noise = false;   // the number of electrons is a Poisson variable
    double dark_current = 0;   // electrons per second and pixel
    double hot_pixels = 0;     // share of the pixels whose dark current is hot_factor times that
    double hot_factor = 100;
    // Electrons per (flux unit / m²) and second. 0: the brightest pixel of all views fills `fill` of the well
    // in the shortest exposure.
    double sensitivity = 0;
    double fill = 0.8;
    std::uint64_t seed = 1;
    // Photographs finer than M's pixels: sensor pixels per pixel of M and axis, and a margin around them that
    // is to be cropped, in sensor pixels.
    V2i oversampling{1, 1};
    V2i margin{0, 0};
    // Setup B only: a pinhole that looks at the screen's back; in metres, in the rig's frame (S at z = 0, the
    // screen at z = D), and the photograph's size. A place of z = 0: straight behind the screen, far enough.
    Imath::V3d place{0, 0, 0};
    V2i photograph{0, 0};  // pixels; 0: oversampling times M's
    // Counts of no light; below 0: six deviations of the read noise, so that noise is not cut off at black.
    double pedestal = -1;
    int darks = 4;               // photographs of no light, of every exposure time
    std::string format = "png";  // of photographs: png, tiff, or exr for floats
};

// The table [camera]; what it lacks stays as above. Throws InputError naming line and column.
CameraModel read_camera(const TomlTable& table);

// A lamp, by numbers. Lengths in metres.
struct EmitterDescription {
    enum class Kind : std::uint8_t { disc, rectangle, projector, scene } kind = Kind::disc;
    double setback = 0;  // of its plane behind S; of a scene's z = 0
    double flux = 1;     // of all its light, in `unit`; of a scene 0: as its lights have it
    FluxUnit unit = FluxUnit::lumen;
    Rgb colour{1.0F};  // luminance 1; of a projector, of the light behind its slide

    // Disc and rectangle: intensity ∝ cos^exponent θ.
    V2d half_size{0, 0};  // of a disc, both are the radius; of a projector, the lens's
    double exponent = 1;
    std::optional<Rgb> rim_colour, grazing_colour;  // luminance 1: ColourCourse

    // Projector.
    double focal_length = 0;
    double focus = 0;             // from the lens to the plane on which the slide is sharp, > focal_length
    V2d slide_size{0, 0};         // of the slide itself
    bool inverted = false;        // the slide lets through 1 - its picture
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

// Parts of it, for other descriptions of measurements: the table [rig], and the key "colour" (white if there
// is none).
Rig read_planes(const TomlTable& table);
Rgb read_colour(const TomlTable& table, std::string_view key = "colour");

// Adds all numbers of a rig.
void add(WordHash& hash, const Rig& rig);

// A name for all numbers of a description; the files that it names count by their names only.
std::uint64_t description_key(const RigDescription& description);

}  // namespace lucerna
