// The description of a virtual measurement: the rig, the lamp that stands before it, and its camera.
//
// People write it as TOML; docs/rig-files.md is its reference. What can be said with lengths alone is checked
// here; files that it names (a slide, a scene) are read by whoever measures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "engine/base/hash.h"
#include "engine/base/toml.h"
#include "lights/light_field.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/camera_model.h"

namespace lucerna {

// A lamp, by numbers. Lengths in metres.
struct EmitterDescription {
    enum class Kind : std::uint8_t { disc, rectangle, projector, scene } kind = Kind::disc;
    double setback = 0;  // of its plane behind S; of a scene's z = 0
    double flux = 1;     // of all its light, in `unit`; of a scene 0: as its lights have it
    FluxUnit unit = FluxUnit::lumen;
    Rgb colour{1.0F};  // luminance 1

    // Disc and rectangle: intensity ∝ cos^exponent θ.
    V2d half_size{0, 0};  // of a disc, both are the radius; of a projector, the lens's
    double exponent = 1;

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
Rgb read_colour(const TomlTable& table);

// Adds all numbers of a rig.
void add(WordHash& hash, const Rig& rig);

// A name for all numbers of a description; the files that it names count by their names only.
std::uint64_t description_key(const RigDescription& description);

}  // namespace lucerna
