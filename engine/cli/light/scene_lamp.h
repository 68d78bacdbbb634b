// Makes a lamp of a luminaire in a scene without a rig: its rays are traced and imported.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/render/job.h"
#include "lights/flux_unit.h"
#include "lights/measurement/lumigraph_fit.h"

namespace lucerna {

struct SceneLampOptions {
    std::filesystem::path file;      // the scene
    std::int64_t paths = 4'000'000;  // light paths, 1 to 2^32
    std::uint64_t seed = 0;
    std::optional<FluxUnit> unit;  // of the lamp; none: the scene's
    double flux = 0;      // of all light that leaves the luminaire, in `unit`; 0: as the scene has it
    bool strict = false;  // turns warnings about replaced or omitted parts into errors
    LumigraphOptions lumigraph;
    std::function<void(const Job& job)> when_read = {};  // called before any work; may be empty
};

// The balance of a luminaire: emitted = leaving + absorbed by materials + cut + roulette, in `unit`.
struct SceneLampAccount {
    struct Loss {
        std::string material;  // the name, or the kind of a material without a name
        double flux = 0;
    };
    FluxUnit unit = FluxUnit::watt;
    double emitted = 0, leaving = 0;
    std::vector<Loss> absorbed;  // by name, the largest loss first
    double cut = 0;              // of paths that reached the greatest length
    double roulette = 0;         // what Russian roulette removed minus what it added; its mean is 0
    std::int64_t paths = 0;
};

struct SceneLamp {
    LumigraphFit fit;
    SceneLampAccount account;
};

// Traces all light paths of the scene and fits a lamp to the rays that leave it, as fit_lumigraph() does. In
// a parallel job all ranks trace, and rank 0 alone has a result. Throws InputError naming file and cause, and
// Stopped if the user stops it.
std::optional<SceneLamp> make_scene_lamp(const SceneLampOptions& options, const Workers& workers,
                                         Monitor& monitor);

void print_account(std::ostream& out, const SceneLampAccount& account);

}  // namespace lucerna
