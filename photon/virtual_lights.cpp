#include "photon/virtual_lights.h"

#include "photon/virtual_light_of.h"

namespace lucerna {
namespace {

struct OneSet {
    std::vector<VirtualLight> lights;
    Ledger ledger;
};

void store(const WalkHit& at, const Stream& stream, std::vector<VirtualLight>& lights) {
    if (const auto light = virtual_light_of(at, stream)) lights.push_back(*light);
}

void store(const WalkScatter& at, std::vector<VirtualLight>& lights) {
    lights.push_back({SurfacePoint{at.p}, at.power, true, at.g, at.d});
}

OneSet walk_set(const Scene& scene, const VirtualLightPlan& plan, std::uint32_t set) {
    OneSet result;
    Emission emission(scene, plan.seed, Purpose::virtual_light, plan.pass);
    // Consecutive indices: paths 2^k of a set are a net, and so are all paths of all sets.
    const std::uint64_t first = std::uint64_t{set} * plan.paths;
    emission.for_each(
        first, first + plan.paths, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
            ++result.ledger.paths;
            if (!start) {
                ++result.ledger.not_emitted;
                return;
            }
            Stream stream = Stream::stratified(plan.seed, Purpose::virtual_light, plan.pass, path);
            walk(
                scene, *start, stream, result.ledger,
                [&](const WalkHit& at) { store(at, stream, result.lights); },
                [&](const WalkScatter& at) { store(at, result.lights); });
        });
    return result;
}

}  // namespace

VirtualLightSets build_virtual_lights(const Scene& scene, const VirtualLightPlan& plan,
                                      const Workers& workers, Monitor& monitor) {
    std::vector<OneSet> sets(plan.sets);
    {
        Phase phase(monitor, "virtual lights", plan.sets);
        parallel_chunks(workers, plan.sets, [&](std::int64_t set) {
            if (monitor.stopped()) return;
            sets[static_cast<std::size_t>(set)] = walk_set(scene, plan, static_cast<std::uint32_t>(set));
            phase.advance(1);
        });
    }
    VirtualLightSets result;
    result.begins.push_back(0);
    for (const OneSet& set : sets) {
        result.lights.insert(result.lights.end(), set.lights.begin(), set.lights.end());
        result.begins.push_back(static_cast<std::uint32_t>(result.lights.size()));
        result.ledger.add(set.ledger);
    }
    result.ledger.scale(1.0 / (static_cast<double>(plan.sets) * plan.paths));
    return result;
}

}  // namespace lucerna
