// A luminaire traced by the engine, on the virtual measuring bench.
//
// The luminaire is a scene file; its light paths come in blocks, each of which is measured through both
// opacities of the filter. Stopped work leaves its sums beside the output and goes on from there.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "lights/measurement/opacity.h"
#include "lights/measurement/ray_projection.h"
#include "photon/luminaire.h"

namespace lucerna {

struct SceneEmitter {
    std::filesystem::path file;      // scene text; light leaves along +z of its world
    std::int64_t rays = 20'000'000;  // light paths, 1 to 2^32
    std::uint64_t seed = 0;
    FluxUnit unit = FluxUnit::watt;  // what the powers of the scene's lights count
    double flux = 0;  // of all light that leaves the luminaire, in the unit; 0: as the scene has it
    std::int64_t block = std::int64_t{1} << 20;  // light paths between two chances to stop
    SlabAxes side = {};   // of the luminaire, which is turned to the rig; light of the others is backward
    bool strict = false;  // what the reader would replace or leave out with a warning is an error
    // Called when the scene has been read, before any work. May be empty.
    std::function<void(const Job& job)> when_read = {};
};

struct SceneAcquisition {
    FilterImages images;
    FluxAccount account;  // of the light that leaves the luminaire: total, backward, beside S, beside M …
    double emitted = 0;   // by the lights inside, in the unit
    double absorbed = 0;  // inside
    SamplingNoise noise;  // of the field's coefficients
    std::int64_t paths = 0;
};

// Traces and measures. `part` keeps the sums of work that was stopped (empty: nothing is kept); it is read
// when it belongs to the same luminaire, rig and seed, and removed by the caller when the result is written.
// Throws InputError for a scene or a rig that is none, and when the user stops it (after writing `part`). Of
// ranks, rank 0 has the result, and the part; all throw Stopped.
SceneAcquisition acquire_scene(const SceneEmitter& emitter, const Rig& rig, const std::filesystem::path& part,
                               const Workers& workers, Monitor& monitor);

}  // namespace lucerna
