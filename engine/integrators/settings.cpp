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
Field flag(std::string_view name, std::string_view help, bool& target) {
    return {name, help, {}, 0, 1, false, &target};
}
template <typename E>
Field choice(std::string_view name, std::string_view help, std::vector<std::string_view> names, E& target) {
    const double last = static_cast<double>(names.size()) - 1;
    return {name, help, std::move(names), 0, last, true, as_byte(target)};
}

Field quantity(Quantity& target) {
    return choice("quantity", "radiance, or illuminance on the first visible surface",
                  {"radiance", "illuminance"}, target);
}

Field lights(LightSelection& target) {
    return choice("lights", "selection of one light among many: power, or tree (by power and position)",
                  {"power", "tree"}, target);
}

// Of every method that estimates from photons.
Field ratio(float& target) {
    return real("ratio",
                "radius of the search ball relative to the projected disc; larger values find more photons "
                "around corners",
                1, 1000, target);
}
Field kernel_shape(KernelShape& target) {
    return choice("kernel", "filter kernel over the disc: constant, cone or epanechnikov",
                  {"constant", "cone", "epanechnikov"}, target);
}
Field metric(MetricKind& target) {
    return choice("metric", "photon distance: projected (tangent plane) or euclidean",
                  {"projected", "euclidean"}, target);
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
Field pre_pass_defensive_weight(float& target) {
    return real("prepassdefensive",
                "defensive mixture weight: minimum share of emission by power in the mixture with the "
                "learned density",
                0.01, 1, target);
}
Field boundary(Boundary& target) {
    return choice("boundary",
                  "correction for discs that extend beyond an edge: none, or probes (divide by the share "
                  "inside, estimated with probe rays)",
                  {"none", "probes"}, target);
}

std::vector<Field> fields_of(PathSettings& s) {
    return {
        whole("guidelights",
              "light paths whose first hits guide the selection of lights, for example 200000; 0: no guiding",
              0, 4294967296.0, s.guide_lights),
        whole("guidepaths",
              "light paths whose photons guide bounces where it reduces noise, for example 100000; 0: no "
              "guiding",
              0, 4294967296.0, s.guide_paths),
        real("bsdfshare",
             "defensive mixture weight: minimum share of the BSDF's density in the mixture with the guide's",
             0.01, 1, s.bsdf_share),
        max_depth(s.max_depth),
        lights(s.lights),
        quantity(s.quantity)};
}

std::vector<Field> fields_of(DirectSettings& s) {
    return {max_depth(s.max_depth), lights(s.lights), quantity(s.quantity)};
}

std::vector<Field> fields_of(PhotonMapSettings& s) {
    return {
        whole("photons", "light paths to emit, unless a target below is set", 1, 4294967296.0, s.photons),
        whole("causticphotons", "target: emit until the Caustic map holds this many photons; 0: no target", 0,
              1e9, s.caustic_photons),
        whole("indirectphotons", "target: emit until the Global map holds this many photons; 0: no target", 0,
              1e9, s.indirect_photons),
        choice("direct",
               "direct light: mc (sample the lights), map (the Direct map), gated (mc where there are "
               "photons nearby) or guided (sample the lights according to nearby photons)",
               {"mc", "map", "gated", "guided"}, s.direct),
        lights(s.lights),
        whole("guidephotons", "light paths of the Direct map for gated and guided", 1, 4294967296.0,
              s.guide.photons),
        whole("guidek", "number of nearest direct photons used for guiding", 1, GuideSettings::kMostPhotons,
              s.guide.k),
        real("guidedefensive",
             "defensive mixture weight: minimum share of the unguided selection of lights in the mixture "
             "with the guide",
             0.01, 1, s.guide.defensive_weight),
        whole("candidates",
              "candidate points on lights that guided evaluates for each shadow ray; 0: 16 if a light has "
              "parts, otherwise 4",
              0, GuidedLightSettings::kMostCandidates, s.guide.candidates),
        choice("indirect",
               "indirect light: gather (final gather), map (the maps are read directly) or none (direct "
               "light only)",
               {"gather", "map", "none"}, s.indirect),
        choice("guidegather",
               "guide gather rays with photons of the Global map: auto (where it reduces noise; needs "
               "gatherrays=0), on or off",
               {"auto", "on", "off"}, s.guide_gather),
        real("cosineshare",
             "defensive mixture weight: minimum share of the cosine density in the mixture with the guide's",
             0.01, 1, s.cosine_share),
        whole("gatherrays",
              "final-gather rays per camera sample; 0: chosen adaptively at each point, as are light samples "
              "and density estimates",
              0, 1'000'000, s.gather_rays),
        whole("precompute",
              "precomputed irradiance for gather rays, at one point for every n photons; 0: off", 0,
              1'000'000, s.precompute),
        whole("precomputelights", "light samples at each such point; 0: gather rays sample the lights", 0,
              10'000, s.precompute_lights),
        whole("k", "photons in a density estimate seen by the camera; 0: all within the radius", 0, kMostInt,
              s.estimate.k),
        whole("gatherk", "photons in a density estimate at the hit of a gather ray; 0: all within the radius",
              0, kMostInt, s.gather_k),
        real("radius", "maximum radius of a density estimate, scene units; 0: 5 % of the scene's diagonal", 0,
             kMost, s.estimate.radius),
        ratio(s.estimate.ratio),
        kernel_shape(s.estimate.kernel),
        metric(s.estimate.metric),
        choice("index",
               "search structure of the photon maps: tree (built in) or flann; both give the same image",
               {"tree", "flann"}, s.index),
        boundary(s.estimate.boundary),
        pre_pass(s.pre_pass.paths),
        pre_pass_defensive_weight(s.pre_pass.defensive_weight),
        real("specularbelow",
             "GGX alpha below which gloss counts as specular for the Caustic map; 0: only mirrors and smooth "
             "glass",
             0, kMost, s.specular_below),
        max_depth(s.max_depth),
        quantity(s.quantity),
    };
}

std::vector<Field> fields_of(IgiSettings& s) {
    constexpr int kMostTreeSamples = 256, kMostShadowRays = 64;
    return {
        whole("nlights", "light paths per set, rounded up to a power of 2", 1, kMostPowerOf2, s.nlights),
        whole("nsets",
              "independent sets, rounded up to a power of 2; should be close to the samples per pixel", 1,
              kMostPowerOf2, s.nsets),
        real("mindist",
             "distance below which virtual point lights fade out, scene units; 0: no fading; -1: 2 % of the "
             "scene's diagonal",
             -1, kMost, s.mindist),
        real("glimit",
             "upper limit of cos cos / d^2 of a virtual point light, per scene unit squared, in addition to "
             "mindist; 0: no limit",
             0, kMost, s.glimit),
        flag("compensate",
             "trace rays for the light that mindist and glimit remove, and for indirect light via mirrors, "
             "glass and gloss",
             s.compensate),
        whole("gathersamples", "compensation rays per camera sample", 1, 1'000'000, s.gather_samples),
        choice("caustics",
               "light from lamps via mirrors, glass and gloss: map (photons), rays (compensation rays, as "
               "noisy as path) or none",
               {"map", "rays", "none"}, s.caustics),
        whole("causticpaths", "light paths to emit for the Caustic map, if a surface can cause caustics", 1,
              4294967296.0, s.caustic_paths),
        choice(
            "choice",
            "virtual point lights per shading point: loop (all of one set) or tree (samples from all sets)",
            {"loop", "tree"}, s.choice),
        whole("treesamples", "virtual point lights sampled from the tree at each shading point", 1,
              kMostTreeSamples, s.tree_samples),
        real("rrthreshold",
             "luminance below which shadow rays are subject to Russian roulette; -1: rays are distributed by "
             "contribution, see shadowrays",
             -1, kMost, s.rr_threshold),
        real("rrcontinue", "probability that a shadow ray below rrthreshold is traced", 1e-6, 1,
             s.rr_continue),
        whole("shadowrays",
              "approximate number of shadow rays per shading point, distributed in proportion to estimated "
              "contributions; 0: one for every light",
              0, kMostShadowRays, s.shadow_rays),
        real("indirectscale", "factor on the indirect light", 0, kMost, s.indirect_scale),
        lights(s.lights),
        pre_pass(s.pre_pass.paths),
        pre_pass_defensive_weight(s.pre_pass.defensive_weight),
        max_depth(s.max_depth),
        quantity(s.quantity),
    };
}

std::vector<Field> fields_of(ProgressiveSettings& s) {
    return {
        whole("photons", "light paths per pass", 1, 4294967296.0, s.photons),
        whole("samples", "camera samples per pixel and pass; one of them estimates density", 1, 1 << 16,
              s.samples),
        real("alpha",
             "rate at which the radius shrinks, r^2 by (i + alpha)/(i + 1); 1: constant radius, and biased",
             0.01, 1, s.alpha),
        choice("direct", "direct light: mc (sample the lights) or map (the Direct map)", {"mc", "map"},
               s.direct),
        lights(s.lights),
        whole("k", "photons of one pass within the initial radius", 1, 1'000'000, s.estimate.k),
        real("radius", "initial radius everywhere, scene units; 0: from k and the local density", 0, kMost,
             s.estimate.radius),
        ratio(s.estimate.ratio),
        kernel_shape(s.estimate.kernel),
        metric(s.estimate.metric),
        boundary(s.estimate.boundary),
        pre_pass(s.pre_pass.paths),
        pre_pass_defensive_weight(s.pre_pass.defensive_weight),
        max_depth(s.max_depth),
        quantity(s.quantity),
    };
}

// In the order of the variant.
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
    if (auto* flag = std::get_if<bool*>(&target)) {
        if (!std::holds_alternative<bool>(value)) {
            input_error(at, "{}: {} is not accepted; expected true or false", name, quoted(value));
        }
        **flag = std::get<bool>(value);
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

void set_parameter(IntegratorSettings& settings, std::string_view name, const SettingValue& value,
                   const Location& at) {
    std::vector<std::string_view> names;
    for (Field& field : fields(settings)) {
        if (field.name == name) return field.set(value, at);
        names.push_back(field.name);
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
