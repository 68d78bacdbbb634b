#include "photon/virtual_lights.h"

namespace lucerna {
namespace {

struct OneSet {
    std::vector<VirtualLight> lights;
    Ledger ledger;
};

OneSet walk_set(const Scene& scene, const VirtualLightPlan& plan, std::uint32_t set) {
    OneSet result;
    for (std::uint32_t path = 0; path < plan.paths; ++path) {
        // Consecutive indices: paths 2^k of a set are a net, and so are all paths of all sets.
        Stream stream =
            Stream::stratified(plan.seed, Purpose::virtual_light, plan.pass, set * plan.paths + path);
        ++result.ledger.paths;
        const auto start = emit_path(scene, stream);
        if (!start) {
            ++result.ledger.not_emitted;
            continue;
        }
        walk(scene, *start, stream, result.ledger, [&](const WalkHit& at) {
            // Mirrors and smooth glass scatter no light that a shadow ray could bring.
            if (at.bsdf.is_delta() || at.bsdf.is_black()) return;
            SurfacePoint lit = at.hit.at;
            if (lit.n.dot(at.d) > 0) lit.n = -lit.n;
            const Rgb contribution = at.power * at.bsdf.albedo(-at.d) * kInvPi;
            if (!is_black(contribution)) result.lights.push_back({lit, contribution});
        });
    }
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
