// Traces a luminaire with the engine on the virtual measuring bench.
//
// The luminaire is a scene file. Its light paths come in blocks, each measured through both opacities of the
// filter. Interrupted work saves its sums beside the output and continues from them.
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
    FluxUnit unit = FluxUnit::watt;  // unit of the powers of the scene's lights
    double flux = 0;                 // of all light that leaves the luminaire, in `unit`; 0: the scene's
    std::int64_t block = std::int64_t{1} << 20;  // light paths between two chances to stop
    SlabAxes side = {};   // side of the luminaire that faces the rig; light to other sides is backward
    bool strict = false;  // turns warnings about replaced or omitted parts of the scene into errors
    // Called when the scene has been read, before any work. May be empty.
    std::function<void(const Job& job)> when_read = {};
};

struct SceneAcquisition {
    FilterImages images;
    FluxAccount account;  // of the light that leaves the luminaire: total, backward, beside S, beside M …
    double emitted = 0;   // by the lights inside, in the unit
    double absorbed = 0;  // in the luminaire
    SamplingNoise noise;  // of the field's coefficients
    std::int64_t paths = 0;
};

// Traces and measures. `part` saves the sums of interrupted work (empty: nothing is saved). It is read if it
// belongs to the same luminaire, rig and seed, and the caller removes it once the result is written. Throws
// InputError for an invalid scene or rig, and Stopped when the user stops it (after writing `part`). In a
// parallel job rank 0 has the result and the part, and all ranks throw Stopped.
SceneAcquisition acquire_scene(const SceneEmitter& emitter, const Rig& rig, const std::filesystem::path& part,
                               const Workers& workers, Monitor& monitor);

}  // namespace lucerna
