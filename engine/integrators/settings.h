// Defines typed settings of the integrators, and the one table that names them.
//
// The table (fields) names the parameters that scene files, `--set`, `--help`, the EXR header and the
// statistics know. Members that it does not name keep their defaults.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/guiding/guide.h"
#include "engine/guiding/importance_pre_pass.h"
#include "engine/scene/quantity.h"
#include "engine/vpl/igi_settings.h"
#include "lights/light_tree.h"
#include "photon/density_estimate.h"
#include "photon/photon_map.h"

namespace lucerna {

// Holds the settings of the path tracer, the unbiased reference.
struct PathSettings {
    int max_depth = 0;  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
    std::int64_t guide_lights = 0;  // light paths whose first hits guide the choice of lights; 0: unguided
    std::int64_t guide_paths = 0;   // light paths whose photons guide bounces; 0: unguided
    std::int64_t chains = 1 << 20;  // light paths that look for mirrors and glass before lamps; 0: none
};

// Holds the settings of direct light alone; mirrors and glass are followed.
struct DirectSettings {
    int max_depth = 0;  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

enum class DirectMethod : std::uint8_t { mc, map, gated, guided };
enum class IndirectMethod : std::uint8_t { gather, map, none };

struct PhotonMapSettings {
    std::int64_t photons = 1'000'000;  // light paths emitted, unless a target is set
    // Light paths are emitted until the Caustic and the Global map hold so many photons. 0: no target.
    std::int64_t caustic_photons = 0, indirect_photons = 0;
    DirectMethod direct = DirectMethod::mc;
    IndirectMethod indirect = IndirectMethod::gather;
    // Each camera sample takes this many gather rays. With 0 the number is adaptive, and photons guide the
    // rays where that reduces noise (splitting.h).
    int gather_rays = 0;
    // Irradiance is precomputed where a bounce from one photon in n lands. With 0, density is estimated where
    // each gather ray ends.
    int precompute = 4;
    // Applies to what the camera sees. A radius of 0 means 5 % of the scene's diagonal.
    DensityEstimateSettings estimate = {.radius = 0, .boundary = Boundary::probes};
    int gather_k = 50;  // photons in an estimate where a gather ray lands; the rest is as above
    IndexKind index = IndexKind::tree;  // acceleration structure of photons; all give the same image
    // Lobes whose GGX alpha (the larger one) is smaller count as specular: light that comes over nothing else
    // goes to the Caustic map. With 0, only perfect mirrors and smooth glass do; caustics of gloss are found
    // by gather rays, or go to the Global map.
    float specular_below = 0;
    std::int64_t pre_pass = 0;  // light paths of the importance pre-pass, in [0, 2^24]; 0: none
    int max_depth = 0;          // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

// Holds the settings of progressive photon mapping [Knaus and Zwicker 2011]: photon maps are seen directly,
// and each pass has its own photons and a smaller radius (photon/radius_schedule.h). Every pass is biased;
// their mean is consistent.
struct ProgressiveSettings {
    std::int64_t photons = 100'000;  // light paths emitted in each pass
    // Each pass takes this many camera samples per pixel. All of them sample direct light, but only one of
    // them estimates density, which costs as much as several light samples.
    int samples = 4;
    float alpha = 2.0F / 3;                  // r²_{i+1} / r²_i = (i + alpha) / (i + 1)
    DirectMethod direct = DirectMethod::mc;  // mc or map
    // `k` photons of one pass lie within the first radius. `radius` is the first radius everywhere; 0 derives
    // it from k and the local density. Probes reduce the bias at edges, which falls slowest as discs shrink.
    DensityEstimateSettings estimate = {.k = 60, .radius = 0, .boundary = Boundary::probes};
    IndexKind index = IndexKind::tree;  // acceleration structure of photons; all give the same image
    std::int64_t pre_pass = 0;          // light paths of the importance pre-pass, in [0, 2^24]; 0: none
    int max_depth = 0;                  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

using IntegratorSettings =
    std::variant<PathSettings, DirectSettings, PhotonMapSettings, IgiSettings, ProgressiveSettings>;

// Returns the integrators' names: "path", "direct", "photonmap", "igi", "progressive".
std::span<const std::string_view> integrator_names();
std::string_view integrator_name(const IntegratorSettings& settings);
// Returns the default settings of the named integrator. Throws InputError that lists the known names.
IntegratorSettings make_settings(std::string_view name, const Location& at);

// Holds a value as scene files and the command line give it.
using SettingValue = std::variant<bool, double, std::string>;
std::string quoted(const SettingValue& value);  // formats it for an error message

// Describes one parameter of one integrator, bound to a settings object.
struct Field {
    std::string_view name;                  // as in a scene file and after --set
    std::string_view help;                  // one line, with the unit
    std::vector<std::string_view> choices;  // empty unless the parameter is a choice
    double least, most;                     // inclusive, for numbers
    bool whole = false;                     // accepts only integers

    std::string text() const;  // returns the current value
    // Throws InputError that names the value and what is accepted.
    void set(const SettingValue& value, const Location& at);

    std::variant<int*, std::int64_t*, float*, std::uint8_t*> target;
    bool in_studies = false;  // meant for studies, not for users
};

std::vector<Field> fields(IntegratorSettings& settings);
// Returns which quantity the image shows. Every integrator has this setting.
Quantity quantity_of(const IntegratorSettings& settings);
// Returns the maximum number of bounces of the paths whose light the image shows, from the light to the eye,
// counted as pbrt's `maxdepth`: at surfaces of every kind and in media; a light that is seen directly has 0.
// Returns 0 if there is no limit and Russian roulette ends every path. The setting means the same for every
// integrator, so that their images show the same light (`direct` finds only one bounce that is not specular).
int max_depth_of(const IntegratorSettings& settings);
void set_max_depth(IntegratorSettings& settings, int max_depth);
// Returns what replaces a removed parameter; none if there is no removed one of that name.
std::optional<std::string_view> instead_of_removed(const IntegratorSettings& settings, std::string_view name);
// Sets one parameter by name. Throws InputError with the nearest known name and the list.
void set_parameter(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                   const Location& at);
// Returns names and values ("k", "100"; "kernel", "epanechnikov"; …) for headers and statistics.
std::vector<std::pair<std::string, std::string>> describe(const IntegratorSettings& settings);

// Parses a value after --set or in a study: "1e6" as a number, "true" as a bool, all else as a string.
SettingValue parse_setting(const std::string& text);

}  // namespace lucerna
