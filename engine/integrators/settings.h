// Typed settings of the integrators, and the one table that names them.
//
// The table (fields) is what scene files, `--set`, `--help`, the EXR header and the statistics read: a
// parameter that is not in it does not exist.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/quantity.h"
#include "engine/vpl/igi_settings.h"
#include "lights/light_tree.h"
#include "photon/kernel.h"
#include "photon/photon_index.h"
#include "photon/tangent_metric.h"

namespace lucerna {

// The unbiased reference.
struct PathSettings {
    int max_depth = 0;  // bounces; 0: no limit, roulette ends every path
    LightSelection lights = LightSelection::tree;
    Quantity quantity = Quantity::radiance;
};

// Direct light only; mirrors and glass are followed.
struct DirectSettings {
    LightSelection lights = LightSelection::tree;
    int max_specular_depth = 16;
    Quantity quantity = Quantity::radiance;
};

enum class DirectMethod : std::uint8_t { mc, map, gated, guided };
enum class IndirectMethod : std::uint8_t { gather, map, none };

struct PhotonMapSettings {
    std::int64_t photons = 1'000'000;  // light paths emitted, unless a target is set
    // Targets: paths are emitted until the Caustic and the Global map hold that many photons. 0: none.
    std::int64_t caustic_photons = 0, indirect_photons = 0;
    DirectMethod direct = DirectMethod::mc;
    LightSelection lights = LightSelection::tree;
    // For `gated` and `guided`: light paths of the Direct map they go by.
    std::int64_t guide_photons = 200'000;
    int guide_k = 64;                      // photons of each cached distribution of direct light
    float guide_defensive_weight = 0.25F;  // least share of the plain choice; keeps `guided` unbiased
    // Places of lights that `guided` weighs for one shadow ray; 0: 16 where a light has parts, else 4.
    int candidates = 0;
    IndirectMethod indirect = IndirectMethod::gather;
    int gather_rays = 16;  // per camera sample
    // Precomputed irradiance, a point for one photon in n; 0: estimate at each gather ray's end.
    int precompute = 4;
    // Light samples at each such point; 0: gather rays ask the lights themselves where they land.
    int precompute_lights = 4;
    int k = 100;        // photons in an estimate seen by the camera; 0: all within the radius
    int gather_k = 50;  // photons in an estimate where a gather ray lands; 0: all within the radius
    float radius = 0;   // largest radius of an estimate, scene units; 0: 5 % of the scene's diagonal
    float ratio = 2;    // Euclidean ball over projected disc, >= 1
    KernelShape kernel = KernelShape::epanechnikov;
    MetricKind metric = MetricKind::projected;
    IndexKind index = IndexKind::tree;     // both find the same photons
    Boundary boundary = Boundary::probes;  // what is done where an estimate hangs over a surface's edge
    // Lobes whose GGX alpha (the larger) lies below count as specular: light over them and nothing else goes
    // to the Caustic map. 0: perfect mirrors and smooth glass alone; the caustics of gloss are found by
    // gather rays, or go to the Global map.
    float specular_below = 0;
    // Light paths of the pre-pass that learns which lights, and which of their particles, the camera's view
    // needs (engine/guiding/importance_pre_pass.h); 0: emission by power alone. And the least share of that,
    // which keeps it unbiased and its weights below 1/weight.
    std::int64_t pre_pass = 0;
    float pre_pass_defensive_weight = 0.25F;
    int max_specular_depth = 16;
    Quantity quantity = Quantity::radiance;
};

// Photon maps seen directly, in passes of their own photons each, within a radius that shrinks
// (photon/radius_schedule.h): biased in every pass, consistent in their mean.
struct ProgressiveSettings {
    std::int64_t photons = 100'000;  // light paths emitted in a pass
    int samples = 1;                 // camera samples per pixel in a pass
    float alpha = 2.0F / 3;          // the radius' share r²_{i+1}/r²_i is (i + alpha)/(i + 1)
    DirectMethod direct = DirectMethod::mc;
    LightSelection lights = LightSelection::tree;
    int k = 60;        // photons of one pass that the first radius holds
    float radius = 0;  // the first radius everywhere, scene units; 0: by k and the local density
    float ratio = 2;   // Euclidean ball over projected disc, >= 1
    KernelShape kernel = KernelShape::epanechnikov;
    MetricKind metric = MetricKind::projected;
    // At edges the bias of a shrinking disc falls slowest. A correction that counts the photons of the disc
    // (hull) is not consistent when they become few; probes are.
    Boundary boundary = Boundary::probes;
    std::int64_t pre_pass = 0;  // PhotonMapSettings'; made once, before the first pass
    float pre_pass_defensive_weight = 0.25F;
    int max_specular_depth = 16;
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

    std::variant<bool*, int*, std::int64_t*, float*, std::uint8_t*> target;
};

std::vector<Field> fields(IntegratorSettings& settings);
// What the image shows; every integrator can.
Quantity quantity_of(const IntegratorSettings& settings);
// Sets one parameter by name; throws InputError with the nearest known name and the list.
void set_parameter(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                   const Location& at);
// "k=100 kernel=epanechnikov …", for headers and statistics.
std::vector<std::pair<std::string, std::string>> describe(const IntegratorSettings& settings);

}  // namespace lucerna
