#include "engine/integrators/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "engine/base/units.h"
#include "engine/guiding/guide.h"

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
    return choice("quantity", "radiance, or illuminance: the light that arrives on the first surface seen",
                  {"radiance", "illuminance"}, target);
}

Field lights(LightSelection& target) {
    return choice("lights",
                  "one light of many is chosen by its power, or by a tree that knows where they are",
                  {"power", "tree"}, target);
}

// Of every method that estimates from photons.
Field ratio(float& target) {
    return real("ratio", "search ball over projected disc; larger catches more photons around corners", 1,
                1000, target);
}
Field kernel_shape(KernelShape& target) {
    return choice("kernel", "weight over the disc: constant, cone or epanechnikov",
                  {"constant", "cone", "epanechnikov"}, target);
}
Field metric(MetricKind& target) {
    return choice("metric", "photon distance: projected (tangent plane) or euclidean",
                  {"projected", "euclidean"}, target);
}
Field max_depth(int& target) {
    return whole("maxdepth",
                 "longest path in bounces, from the light to the eye; 0: no limit, roulette ends every path",
                 0, kMostInt, target);
}
Field pre_pass(std::int64_t& target) {
    return whole("prepass",
                 "light paths of the importance pre-pass, from which emission for the view is learned; 65536 "
                 "are plenty; 0: by power",
                 0, 1 << 24, target);
}
Field pre_pass_defensive_weight(float& target) {
    return real("prepassdefensive",
                "defensive mixture weight: least share of emission by power beside the learned density", 0.01,
                1, target);
}
Field boundary(Boundary& target) {
    return choice("boundary",
                  "where a disc hangs over an edge: none, or divide by its share inside, found by probes",
                  {"none", "probes"}, target);
}

std::vector<Field> fields_of(PathSettings& s) {
    return {
        whole("guidelights", "light paths whose first hits guide the choice of lights, about 200000; 0: none",
              0, 4294967296.0, s.guide_lights),
        whole("guidepaths", "light paths whose photons guide bounces where that pays, about 100000; 0: none",
              0, 4294967296.0, s.guide_paths),
        real("bsdfshare",
             "defensive mixture weight: least share of the BSDF's own density beside the guide's", 0.01, 1,
             s.bsdf_share),
        max_depth(s.max_depth),
        lights(s.lights),
        quantity(s.quantity)};
}

std::vector<Field> fields_of(DirectSettings& s) {
    return {max_depth(s.max_depth), lights(s.lights), quantity(s.quantity)};
}

std::vector<Field> fields_of(PhotonMapSettings& s) {
    return {
        whole("photons", "light paths emitted, unless a target below is set", 1, 4294967296.0, s.photons),
        whole("causticphotons", "target: emit until the Caustic map holds that many; 0: no target", 0, 1e9,
              s.caustic_photons),
        whole("indirectphotons", "target: emit until the Global map holds that many; 0: no target", 0, 1e9,
              s.indirect_photons),
        choice("direct",
               "direct light: mc (sample the lights), map (the Direct map), gated (mc where photons are "
               "near) or "
               "guided (sample the lights by the photons near)",
               {"mc", "map", "gated", "guided"}, s.direct),
        lights(s.lights),
        whole("guidephotons", "light paths of the Direct map that gates or guides", 1, 4294967296.0,
              s.guide.photons),
        whole("guidek", "direct photons around a place that guide what is near", 1,
              GuideSettings::kMostPhotons, s.guide.k),
        real("guidedefensive",
             "defensive mixture weight: least share of the plain choice of lights beside the guide", 0.01, 1,
             s.guide.defensive_weight),
        whole("candidates",
              "places of lights that guided weighs for one shadow ray; 0: 16 where a light has parts, else 4",
              0, GuidedLightSettings::kMostCandidates, s.guide.candidates),
        choice("indirect",
               "indirect light: gather (final gather), map (the maps seen directly) or none (direct light "
               "alone)",
               {"gather", "map", "none"}, s.indirect),
        choice("guidegather",
               "photons of the Global map guide gather rays: auto (where it pays; needs gatherrays=0), on or "
               "off",
               {"auto", "on", "off"}, s.guide_gather),
        real("cosineshare",
             "defensive mixture weight: least share of the cosine's own density beside the guide's", 0.01, 1,
             s.cosine_share),
        whole("gatherrays",
              "final-gather rays per camera sample; 0: as many as pay at each place, and light samples and "
              "density estimates likewise",
              0, 1'000'000, s.gather_rays),
        whole("precompute", "precomputed irradiance for gather rays, a point for one photon in n; 0: off", 0,
              1'000'000, s.precompute),
        whole("precomputelights", "light samples at each such point; 0: gather rays sample the lights", 0,
              10'000, s.precompute_lights),
        whole("k", "photons in an estimate that the camera sees; 0: all within the radius", 0, kMostInt,
              s.estimate.k),
        whole("gatherk", "photons in an estimate where a gather ray lands; 0: all within the radius", 0,
              kMostInt, s.gather_k),
        real("radius", "largest radius of an estimate, scene units; 0: 5 % of the scene's diagonal", 0, kMost,
             s.estimate.radius),
        ratio(s.estimate.ratio),
        kernel_shape(s.estimate.kernel),
        metric(s.estimate.metric),
        choice("index", "search of the photon maps: tree (ours) or flann; the same image from both",
               {"tree", "flann"}, s.index),
        boundary(s.estimate.boundary),
        pre_pass(s.pre_pass.paths),
        pre_pass_defensive_weight(s.pre_pass.defensive_weight),
        real("specularbelow",
             "GGX alpha below which gloss counts as specular for the Caustic map; 0: mirrors", 0, kMost,
             s.specular_below),
        max_depth(s.max_depth),
        quantity(s.quantity),
    };
}

std::vector<Field> fields_of(IgiSettings& s) {
    constexpr int kMostTreeSamples = 256, kMostShadowRays = 64;
    return {
        whole("nlights", "light paths per set, rounded up to a power of 2", 1, kMostPowerOf2, s.nlights),
        whole("nsets", "independent sets, rounded up to a power of 2; best near the samples per pixel", 1,
              kMostPowerOf2, s.nsets),
        real("mindist",
             "virtual point lights nearer than this fade out, scene units; 0: none does; -1: 2 % of the "
             "diagonal",
             -1, kMost, s.mindist),
        real(
            "glimit",
            "limit of a virtual point light's cos cos / d^2, per scene unit squared, beside mindist; 0: none",
            0, kMost, s.glimit),
        flag(
            "compensate",
            "rays put back the light that mindist and glimit cut off, and what mirrors, glass and gloss turn",
            s.compensate),
        whole("gathersamples", "compensating rays per camera sample", 1, 1'000'000, s.gather_samples),
        choice(
            "caustics",
            "lamps by way of mirrors, glass and gloss: map (photons), rays (compensating ones, as noisy as "
            "path) or none",
            {"map", "rays", "none"}, s.caustics),
        whole("causticpaths", "light paths emitted for the map of caustics, where a surface throws any", 1,
              4294967296.0, s.caustic_paths),
        choice("choice", "loop: a place looks at all lights of one set; tree: it draws some, of all sets",
               {"loop", "tree"}, s.choice),
        whole("treesamples", "virtual point lights that a place draws from the tree", 1, kMostTreeSamples,
              s.tree_samples),
        real("rrthreshold",
             "luminance below which shadow rays play roulette; -1: rays go where they count, see shadowrays",
             -1, kMost, s.rr_threshold),
        real("rrcontinue", "chance that a shadow ray below rrthreshold is traced", 1e-6, 1, s.rr_continue),
        whole("shadowrays",
              "shadow rays of a place, about, in proportion to what lights may bring; 0: one for every light",
              0, kMostShadowRays, s.shadow_rays),
        real("indirectscale", "multiplies the indirect light", 0, kMost, s.indirect_scale),
        lights(s.lights),
        pre_pass(s.pre_pass.paths),
        pre_pass_defensive_weight(s.pre_pass.defensive_weight),
        max_depth(s.max_depth),
        quantity(s.quantity),
    };
}

std::vector<Field> fields_of(ProgressiveSettings& s) {
    return {
        whole("photons", "light paths emitted in a pass", 1, 4294967296.0, s.photons),
        whole("samples", "camera samples per pixel in a pass, of which one estimates density", 1, 1 << 16,
              s.samples),
        real("alpha", "how fast the radius shrinks, r^2 as (i + alpha)/(i + 1); 1: not at all, and biased",
             0.01, 1, s.alpha),
        choice("direct", "direct light: mc (sample the lights) or map (the Direct map)", {"mc", "map"},
               s.direct),
        lights(s.lights),
        whole("k", "photons of one pass that the first radius holds", 1, 1'000'000, s.estimate.k),
        real("radius", "the first radius everywhere, scene units; 0: by k and the local density", 0, kMost,
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
    input_error(at, "unknown integrator \"{}\"; known are {}", name, fmt::join(kIntegratorNames, ", "));
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
            input_error(at, "{}: {} is not accepted; choose {}", name, quoted(value),
                        fmt::join(choices, ", "));
        }
        *std::get<std::uint8_t*>(target) = static_cast<std::uint8_t>(found - choices.begin());
        return;
    }
    if (auto* flag = std::get_if<bool*>(&target)) {
        if (!std::holds_alternative<bool>(value)) {
            input_error(at, "{}: {} is not accepted; true or false is", name, quoted(value));
        }
        **flag = std::get<bool>(value);
        return;
    }
    const double* number = std::get_if<double>(&value);
    const bool in_range = number && *number >= least && *number <= most;  // false for NaN
    if (!in_range || (whole && *number != std::floor(*number))) {
        input_error(at, "{}: {} is not accepted; a {} from {:g} to {:g} is", name, quoted(value),
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
