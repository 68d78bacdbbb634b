#include "engine/integrators/igi_thinning.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

namespace lucerna {
namespace {

// Places at which each VPL is tried. Those of one set that is kept light every pixel once or more: so that
// trying them takes a tenth of the time of that, kThinning times as many are tried at as many places as that
// leaves, within bounds.
constexpr float kShareOfTime = 0.1F;
constexpr float kLeastLooks = 16, kMostLooks = 256;

std::size_t looks(const View& view, std::uint32_t factor) {
    const V2f size = view.end - view.begin;
    const float share = kShareOfTime * size.x * size.y / static_cast<float>(factor);
    return static_cast<std::size_t>(std::clamp(share, kLeastLooks, kMostLooks));
}

// Samplers of VPLs and of sets; paths' own end where theirs do.
constexpr std::uint32_t kLightsPass = 0xfffffffdU, kSetsPass = 0xfffffffcU;

float importance_of(const Vpl& light, const SeenPlaces& seen, const PlaceShading& shading, std::size_t looks,
                    Sampler& sampler) {
    double sum = 0;
    for (std::size_t i = 0; i < looks; ++i) {
        const float u = (static_cast<float>(i) + sampler.next()) / static_cast<float>(looks);
        const auto drawn = static_cast<std::size_t>(u * static_cast<float>(seen.places.size()));
        const SeenPlace& place = seen.places[std::min(drawn, seen.places.size() - 1)];
        const double share =
            double{shading.radiance(place, light, sampler)} / double{seen.shown[place.ray]};  // shown > 0
        sum += share * share;
    }
    return static_cast<float>(std::sqrt(sum / static_cast<double>(looks)));
}

std::vector<float> importances_of(const VplSets& sets, std::size_t many, const SeenPlaces& seen,
                                  const IgiSettings& settings, const PassContext& context) {
    constexpr std::int64_t kGrain = 1024;  // fixed, so that results do not depend on threads
    const PlaceShading shading(context.scene, settings);
    const auto count = static_cast<std::int64_t>(sets.lights.size());
    std::vector<float> result(sets.lights.size());
    Phase phase(context.monitor, "virtual point lights that matter", sets.lights.size());
    parallel_ranges(
        context.workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
            if (context.monitor.stopped()) return;
            for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
                Sampler sampler(context.seed, Purpose::importance, kLightsPass, i);
                result[i] = importance_of(sets.lights[i], seen, shading, many, sampler);
            }
            phase.advance(static_cast<std::uint64_t>(end - begin));
        });
    return result;
}

// With which each light is kept: in proportion to its importance, never more than 1, and `wanted` of them on
// average.
std::vector<double> chances(std::span<const float> importance, double defensive_weight, double wanted) {
    double mean = 0;
    for (const float w : importance) mean += double{w} / static_cast<double>(importance.size());
    std::vector<double> chance;
    for (const float w : importance)
        chance.push_back(mean > 0 ? defensive_weight * mean + (1 - defensive_weight) * double{w} : 1.0);
    // What is cut off at 1 goes to the others: a few rounds, each of which leaves less.
    double scale = 0;
    for (int round = 0; round < 8; ++round) {
        double sure = 0, open = 0;
        for (const double c : chance) {
            if (scale * c < 1) {
                open += c;
            } else {
                ++sure;
            }
        }
        if (!(open > 0) || !(wanted > sure)) break;
        scale = (wanted - sure) / open;
    }
    for (double& c : chance) c = std::min(scale * c, 1.0);
    return chance;
}

}  // namespace

VplSets thin_vpls(const VplSets& sets, std::uint32_t factor, const SeenPlaces& seen,
                  const IgiSettings& settings, const PassContext& context) {
    const std::vector<float> all =
        importances_of(sets, looks(*context.view, factor), seen, settings, context);
    if (context.monitor.stopped()) return sets;
    const std::vector<double> chance =
        chances(all, double{settings.pre_pass_defensive_weight}, static_cast<double>(all.size()) / factor);
    VplSets kept;
    kept.ledger = sets.ledger;
    kept.begins.push_back(0);
    for (std::size_t set = 0; set + 1 < sets.begins.size(); ++set) {
        // One is kept wherever the sum of the chances passes a whole number.
        Sampler sampler(context.seed, Purpose::importance, kSetsPass, set);
        double sum = double{sampler.next()};
        for (std::size_t i = sets.begins[set]; i < sets.begins[set + 1]; ++i) {
            const double before = std::floor(sum);
            sum += chance[i];
            if (!(std::floor(sum) > before)) continue;
            kept.lights.push_back(sets.lights[i]);
            kept.lights.back().contribution *= static_cast<float>(1 / chance[i]);  // > 0: it was kept
        }
        kept.begins.push_back(static_cast<std::uint32_t>(kept.lights.size()));
    }
    return kept;
}

}  // namespace lucerna
