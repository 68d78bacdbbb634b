#include "engine/integrators/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "engine/guiding/guide.h"
#include "engine/text/spelling.h"
#include "engine/text/units.h"

namespace lucerna {
namespace {

constexpr double kMost = std::numeric_limits<float>::max();
constexpr double kMostInt = std::numeric_limits<int>::max();
// Set sizes are rounded up to a power of 2, which must stay an int.
constexpr double kMostPowerOf2 = 1 << 24;

template <typename E>
std::uint8_t* as_byte(E& choice) {
    static_assert(sizeof(E) == 1);
    return reinterpret_cast<std::uint8_t*>(&choice);  // an enum class over uint8_t
}

Field whole(std::string_view name, std::string_view help, double least, double most, int& target) {
    return {name, help, {}, least, most, true, &target};
}
Field whole(std::string_view name, std::string_view help, double least, double most, std::int64_t& target) {
    return {name, help, {}, least, most, true, &target};
}
Field real(std::string_view name, std::string_view help, double least, double most, float& target) {
    return {name, help, {}, least, most, false, &target};
}
template <typename E>
Field choice(std::string_view name, std::string_view help, std::vector<std::string_view> names, E& target) {
    const double last = static_cast<double>(names.size()) - 1;
    return {name, help, std::move(names), 0, last, true, as_byte(target)};
}

// Marks a parameter as one that studies vary.
Field in_studies(Field field) {
    field.in_studies = true;
    return field;
}

Field quantity(Quantity& target) {
    return choice("quantity", "radiance, or illuminance on the first visible surface",
                  {"radiance", "illuminance"}, target);
}
Field metric(MetricKind& target) {
    return in_studies(choice("metric", "photon distance: projected (tangent plane) or euclidean",
                             {"projected", "euclidean"}, target));
}
Field index(IndexKind& target) {
    return in_studies(
        choice("index", "search structure of photons: tree (built in) or flann; both give the same image",
               {"tree", "flann"}, target));
}
Field max_depth(int& target) {
    return whole("maxdepth",
                 "maximum path length in bounces, from the light to the eye; 0: unlimited, paths end by "
                 "Russian roulette",
                 0, kMostInt, target);
}
Field pre_pass(std::int64_t& target) {
    return whole("prepass",
                 "light paths of the importance pre-pass, which learns where to emit for the view; 65536 are "
                 "enough; 0: emission by power",
                 0, 1 << 24, target);
}

std::vector<Field> fields_of(PathSettings& s) {
    return {
        max_depth(s.max_depth),
        quantity(s.quantity),
        whole("guidelights",
              "light paths whose first hits guide the selection of lights, for example 200000; 0: no guiding",
              0, 4294967296.0, s.guide_lights),
        whole("guidepaths",
              "light paths whose photons guide bounces where it reduces noise, for example 100000; 0: no "
              "guiding",
              0, 4294967296.0, s.guide_paths),
        in_studies(
            whole("chains",
                  "light paths whose photons tell how small lamps are reached over mirrors and glass, where "
                  "such light matters; 0: rays meet these lamps by chance alone",
                  0, 4294967296.0, s.chains)),
    };
}

std::vector<Field> fields_of(DirectSettings& s) {
    return {max_depth(s.max_depth), quantity(s.quantity)};
}

std::vector<Field> fields_of(PhotonMapSettings& s) {
    return {
        whole("photons",
              "light paths to emit, unless a target below is set; gated and guided emit a fifth as many", 1,
              4294967296.0, s.photons),
        whole("causticphotons", "target: emit until the Caustic map holds this many photons; 0: no target", 0,
              1e9, s.caustic_photons),
        whole("indirectphotons", "target: emit until the Global map holds this many photons; 0: no target", 0,
              1e9, s.indirect_photons),
        choice("direct",
               "direct light: mc (sample the lights), map (the Direct map), gated (mc where there are "
               "photons nearby) or guided (sample the lights according to nearby photons)",
               {"mc", "map", "gated", "guided"}, s.direct),
        choice("indirect",
               "indirect light: gather (final gather), map (the maps are read directly) or none (direct "
               "light only)",
               {"gather", "map", "none"}, s.indirect),
        whole("gatherrays",
              "final-gather rays per camera sample; 0: chosen adaptively at each point, as are light "
              "samples, density estimates and guiding by photons",
              0, 1'000'000, s.gather_rays),
        whole("k", "photons in a density estimate seen by the camera; 0: all within the radius", 0, kMostInt,
              s.estimate.k),
        whole("gatherk", "photons in a density estimate at the hit of a gather ray; 0: all within the radius",
              0, kMostInt, s.gather_k),
        real("radius", "maximum radius of a density estimate, scene units; 0: 5 % of the scene's diagonal", 0,
             kMost, s.estimate.radius),
        pre_pass(s.pre_pass),
        max_depth(s.max_depth),
        quantity(s.quantity),
        in_studies(whole("precompute",
                         "precomputed irradiance for gather rays, at one point for every n photons; 0: off",
                         0, 1'000'000, s.precompute)),
        metric(s.estimate.metric),
        in_studies(choice("kernel", "filter kernel over the disc: constant, cone or epanechnikov",
                          {"constant", "cone", "epanechnikov"}, s.estimate.kernel)),
        in_studies(choice("boundary",
                          "correction for discs that extend beyond an edge: none, or probes (divide by the "
                          "share inside, estimated with probe rays)",
                          {"none", "probes"}, s.estimate.boundary)),
        in_studies(real("specularbelow",
                        "GGX alpha below which gloss counts as specular for the Caustic map; 0: only mirrors "
                        "and smooth glass",
                        0, kMost, s.specular_below)),
        index(s.index),
    };
}

std::vector<Field> fields_of(IgiSettings& s) {
    constexpr int kMostShadowRays = 64;
    return {
        whole("nlights", "light paths per set, rounded up to a power of 2", 1, kMostPowerOf2, s.nlights),
        whole("nsets",
              "independent sets, rounded up to a power of 2; should be close to the samples per pixel", 1,
              kMostPowerOf2, s.nsets),
        real("mindist",
             "distance below which virtual point lights fade out, scene units; 0: 2 % of the scene's "
             "diagonal, or no fading if glimit is set",
             0, kMost, s.mindist),
        whole("gathersamples",
              "compensation rays per camera sample, for the light that mindist and glimit remove and for "
              "indirect light via mirrors, glass and gloss; 0: no compensation",
              0, 1'000'000, s.gather_samples),
        whole("causticpaths",
              "light paths of the Caustic map, for light from lamps via mirrors, glass and gloss; 0: no map, "
              "compensation rays find this light, as noisy as path",
              0, 4294967296.0, s.caustic_paths),
        pre_pass(s.pre_pass),
        max_depth(s.max_depth),
        quantity(s.quantity),
        in_studies(
            real("glimit",
                 "upper limit of cos cos / d^2 of a virtual point light, per scene unit squared; 0: no "
                 "limit",
                 0, kMost, s.glimit)),
        in_studies(real("rrthreshold",
                        "luminance below which shadow rays are subject to Russian roulette; 0: rays are "
                        "distributed by contribution, see shadowrays",
                        0, kMost, s.rr_threshold)),
        in_studies(real("rrcontinue", "probability that a shadow ray below rrthreshold is traced", 1e-6, 1,
                        s.rr_continue)),
        in_studies(whole("shadowrays",
                         "approximate number of shadow rays per shading point, distributed in proportion to "
                         "estimated contributions; 0: one for every light",
                         0, kMostShadowRays, s.shadow_rays)),
        in_studies(real("indirectscale", "factor on the indirect light", 0, kMost, s.indirect_scale)),
        index(s.index),
    };
}

std::vector<Field> fields_of(ProgressiveSettings& s) {
    return {
        whole("photons", "light paths per pass", 1, 4294967296.0, s.photons),
        whole("k", "photons of one pass within the initial radius", 1, 1'000'000, s.estimate.k),
        real("radius", "initial radius everywhere, scene units; 0: from k and the local density", 0, kMost,
             s.estimate.radius),
        choice("direct", "direct light: mc (sample the lights) or map (the Direct map)", {"mc", "map"},
               s.direct),
        pre_pass(s.pre_pass),
        max_depth(s.max_depth),
        quantity(s.quantity),
        in_studies(real(
            "alpha",
            "rate at which the radius shrinks, r^2 by (i + alpha)/(i + 1); 1: constant radius, and biased",
            0.01, 1, s.alpha)),
        index(s.index),
    };
}

// Names a removed parameter and what replaces it.
struct RemovedParameter {
    std::string_view integrator, name, instead;
};
constexpr std::string_view kByTree = "lights are chosen by power and position",
                           kQuarter = "the share of plain sampling is 0.25";
constexpr RemovedParameter kRemovedParameters[] = {
    {"path", "lights", kByTree},
    {"path", "bsdfshare", kQuarter},
    {"direct", "lights", kByTree},
    {"photonmap", "lights", kByTree},
    {"photonmap", "guidephotons", "gated and guided emit a fifth of `photons`"},
    {"photonmap", "guidek", "distributions hold 64 photons"},
    {"photonmap", "guidedefensive", kQuarter},
    {"photonmap", "candidates", "16 candidates are weighed if a light has parts, otherwise 4"},
    {"photonmap", "guidegather", "gatherrays=0 guides where that reduces noise"},
    {"photonmap", "cosineshare", kQuarter},
    {"photonmap", "precomputelights", "4 light samples are taken at each point"},
    {"photonmap", "ratio", "the search ball is twice as wide as the disc"},
    {"photonmap", "prepassdefensive", kQuarter},
    {"igi", "compensate", "gathersamples=1 compensates"},
    {"igi", "caustics", "causticpaths=0 builds no Caustic map"},
    {"igi", "choice", "the virtual point lights of one set are looked at"},
    {"igi", "treesamples", "the virtual point lights of one set are looked at"},
    {"igi", "lights", kByTree},
    {"igi", "prepassdefensive", kQuarter},
    {"progressive", "samples", "a pass takes 4 camera samples per pixel"},
    {"progressive", "metric", "distances are projected on the tangent plane"},
    {"progressive", "lights", kByTree},
    {"progressive", "ratio", "the search ball is twice as wide as the disc"},
    {"progressive", "kernel", "the kernel is epanechnikov"},
    {"progressive", "boundary", "probes correct discs that extend beyond an edge"},
    {"progressive", "prepassdefensive", kQuarter},
};

// Lists the names in the order of the variant.
constexpr std::string_view kIntegratorNames[] = {"path", "direct", "photonmap", "igi", "progressive"};
static_assert(std::size(kIntegratorNames) == std::variant_size_v<IntegratorSettings>);

}  // namespace

std::span<const std::string_view> integrator_names() {
    return kIntegratorNames;
}

Quantity quantity_of(const IntegratorSettings& settings) {
    return std::visit([](const auto& s) { return s.quantity; }, settings);
}

int max_depth_of(const IntegratorSettings& settings) {
    return std::visit([](const auto& s) { return s.max_depth; }, settings);
}

void set_max_depth(IntegratorSettings& settings, int max_depth) {
    std::visit([max_depth](auto& s) { s.max_depth = max_depth; }, settings);
}

std::string_view integrator_name(const IntegratorSettings& settings) {
    return kIntegratorNames[settings.index()];
}

IntegratorSettings make_settings(std::string_view name, const Location& at) {
    if (name == "path") return PathSettings{};
    if (name == "direct") return DirectSettings{};
    if (name == "photonmap") return PhotonMapSettings{};
    if (name == "igi") return IgiSettings{};
    if (name == "progressive") return ProgressiveSettings{};
    input_error(at, "unknown integrator \"{}\"; expected {}", name, fmt::join(kIntegratorNames, ", "));
}

std::string Field::text() const {
    return std::visit(
        [&](auto* value) -> std::string {
            if (!choices.empty()) return std::string(choices[static_cast<std::size_t>(*value)]);
            return fmt::format("{}", *value);
        },
        target);
}

void Field::set(const SettingValue& value, const Location& at) {
    if (!choices.empty()) {
        const auto* word = std::get_if<std::string>(&value);
        const auto found = word ? std::find(choices.begin(), choices.end(), *word) : choices.end();
        if (found == choices.end()) {
            input_error(at, "{}: {} is not accepted; expected {}", name, quoted(value),
                        fmt::join(choices, ", "));
        }
        *std::get<std::uint8_t*>(target) = static_cast<std::uint8_t>(found - choices.begin());
        return;
    }
    const double* number = std::get_if<double>(&value);
    const bool in_range = number && *number >= least && *number <= most;  // false for NaN
    if (!in_range || (whole && *number != std::floor(*number))) {
        input_error(at, "{}: {} is not accepted; expected a {} from {:g} to {:g}", name, quoted(value),
                    whole ? "whole number" : "number", least, most);
    }
    std::visit([&](auto* out) { *out = static_cast<std::remove_reference_t<decltype(*out)>>(*number); },
               target);
}

std::string quoted(const SettingValue& value) {
    if (const auto* word = std::get_if<std::string>(&value)) return '"' + *word + '"';
    if (const auto* number = std::get_if<double>(&value)) return fmt::format("{:g}", *number);
    return std::get<bool>(value) ? "true" : "false";
}

std::vector<Field> fields(IntegratorSettings& settings) {
    return std::visit([](auto& s) { return fields_of(s); }, settings);
}

std::optional<std::string_view> instead_of_removed(const IntegratorSettings& settings,
                                                   std::string_view name) {
    for (const RemovedParameter& removed : kRemovedParameters) {
        if (removed.integrator == integrator_name(settings) && removed.name == name) return removed.instead;
    }
    return std::nullopt;
}

void set_parameter(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                   const Location& at) {
    std::vector<std::string_view> names;
    for (Field& field : fields(settings)) {
        if (field.name == name) return field.set(value, at);
        names.push_back(field.name);
    }
    if (const auto instead = instead_of_removed(settings, name)) {
        input_error(at, "{}: the parameter \"{}\" has been removed; {}", integrator_name(settings), name,
                    *instead);
    }
    input_error(at, "{} has no parameter \"{}\"; {}known are {}", integrator_name(settings), name,
                did_you_mean(name, names), fmt::join(names, ", "));
}

std::vector<std::pair<std::string, std::string>> describe(const IntegratorSettings& settings) {
    IntegratorSettings copy = settings;
    std::vector<std::pair<std::string, std::string>> result;
    for (const Field& field : fields(copy)) result.emplace_back(field.name, field.text());
    return result;
}

SettingValue parse_setting(const std::string& text) {
    if (text == "true" || text == "false") return SettingValue(text == "true");
    double number = 0;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, number);
    if (error == std::errc() && rest == end && std::isfinite(number)) return number;
    return text;
}

}  // namespace lucerna
