// Typed settings of the integrators, and the one table that names them.
//
// The table (fields) names the parameters that scene files, `--set`, `--help`, the EXR header and the
// statistics know. Members that it does not name keep their defaults there.
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

// The unbiased reference.
struct PathSettings {
    int max_depth = 0;  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
    std::int64_t guide_lights = 0;  // light paths whose first hits guide the choice of lights; 0: none do
    std::int64_t guide_paths = 0;   // light paths whose photons guide bounces; 0: none do
};

// Direct light only; mirrors and glass are followed.
struct DirectSettings {
    int max_depth = 0;  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

enum class DirectMethod : std::uint8_t { mc, map, gated, guided };
enum class IndirectMethod : std::uint8_t { gather, map, none };

struct PhotonMapSettings {
    std::int64_t photons = 1'000'000;  // light paths emitted, unless a target is set
    // Targets: paths are emitted until the Caustic and the Global map hold that many photons. 0: none.
    std::int64_t caustic_photons = 0, indirect_photons = 0;
    DirectMethod direct = DirectMethod::mc;
    IndirectMethod indirect = IndirectMethod::gather;
    // Gather rays per camera sample; 0: chosen adaptively, and guided by photons where that reduces noise
    // (splitting.h).
    int gather_rays = 0;
    // Precomputed irradiance, a point for one photon in n; 0: estimate at each gather ray's end.
    int precompute = 4;
    // Of what the camera sees. Radius 0: 5 % of the scene's diagonal.
    DensityEstimateSettings estimate = {.radius = 0, .boundary = Boundary::probes};
    int gather_k = 50;                  // the same where a gather ray lands, but for the number of photons
    IndexKind index = IndexKind::tree;  // search structure of photons; all give the same image
    // Lobes whose GGX alpha (the larger) lies below count as specular: light over them and nothing else goes
    // to the Caustic map. 0: perfect mirrors and smooth glass alone; the caustics of gloss are found by
    // gather rays, or go to the Global map.
    float specular_below = 0;
    std::int64_t pre_pass = 0;  // light paths of the importance pre-pass, in [0, 2^24]; 0: none
    int max_depth = 0;          // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

// Photon maps seen directly, in passes of their own photons each, within a radius that shrinks
// (photon/radius_schedule.h): biased in every pass, consistent in their mean.
struct ProgressiveSettings {
    std::int64_t photons = 100'000;  // light paths emitted in a pass
    // Camera samples per pixel and pass. All of them sample direct light; one of them estimates density,
    // which costs as much as several light samples.
    int samples = 4;
    float alpha = 2.0F / 3;                  // the radius' share r²_{i+1}/r²_i is (i + alpha)/(i + 1)
    DirectMethod direct = DirectMethod::mc;  // mc or map
    // k: photons of one pass that the first radius holds. Radius: the first one everywhere; 0: by k and the
    // local density. At edges the bias of a shrinking disc falls slowest: hence the probes.
    DensityEstimateSettings estimate = {.k = 60, .radius = 0, .boundary = Boundary::probes};
    IndexKind index = IndexKind::tree;  // search structure of photons; all give the same image
    std::int64_t pre_pass = 0;          // light paths of the importance pre-pass, in [0, 2^24]; 0: none
    int max_depth = 0;                  // see max_depth_of()
    Quantity quantity = Quantity::radiance;
};

using IntegratorSettings =
    std::variant<PathSettings, DirectSettings, PhotonMapSettings, IgiSettings, ProgressiveSettings>;

// Every integrator's name: "path", "direct", "photonmap", "igi", "progressive".
std::span<const std::string_view> integrator_names();
std::string_view integrator_name(const IntegratorSettings& settings);
// Default settings of the named integrator; throws InputError listing the names it knows.
IntegratorSettings make_settings(std::string_view name, const Location& at);

// A value as scene files and the command line give it.
using SettingValue = std::variant<bool, double, std::string>;
std::string quoted(const SettingValue& value);  // as an error message shows it

// One parameter of one integrator, bound to a settings object.
struct Field {
    std::string_view name;                  // as in a scene file and after --set
    std::string_view help;                  // one line, with the unit
    std::vector<std::string_view> choices;  // empty unless it is a choice
    double least, most;                     // inclusive, for numbers
    bool whole = false;                     // only whole numbers

    std::string text() const;  // the present value
    // Throws InputError naming the value and what is accepted.
    void set(const SettingValue& value, const Location& at);

    std::variant<int*, std::int64_t*, float*, std::uint8_t*> target;
    bool in_studies = false;  // a study varies it; a user leaves it alone
};

std::vector<Field> fields(IntegratorSettings& settings);
// What the image shows; every integrator can.
Quantity quantity_of(const IntegratorSettings& settings);
// Bounces of the longest paths whose light the image shows, from the light to the eye, as pbrt's `maxdepth`
// counts them: at surfaces of every kind and in media; a light that is seen straight has 0. 0: no limit,
// roulette ends every path. It means the same for every integrator, whose images are therefore of the same
// light (`direct` lacks all but one bounce that is not specular).
int max_depth_of(const IntegratorSettings& settings);
void set_max_depth(IntegratorSettings& settings, int max_depth);
// Returns what takes the place of a parameter that former versions had; none if they had no such one.
std::optional<std::string_view> instead_of_removed(const IntegratorSettings& settings, std::string_view name);
// Sets one parameter by name; throws InputError with the nearest known name and the list.
void set_parameter(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                   const Location& at);
// "k=100 kernel=epanechnikov …", for headers and statistics.
std::vector<std::pair<std::string, std::string>> describe(const IntegratorSettings& settings);

// Settings as people write them after --set and in studies.

// "1e6" as a number, "true" as a truth value, all else as a word.
SettingValue parse_setting(const std::string& text);

}  // namespace lucerna
