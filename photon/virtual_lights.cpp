#include "photon/virtual_lights.h"

#include <algorithm>

#include "engine/base/error.h"
#include "photon/virtual_light_of.h"

namespace lucerna {
namespace {

// Of some paths in a row.
struct Walked {
    std::vector<VirtualLight> lights;
    Ledger ledger;
};

void store(const WalkHit& at, const Stream& stream, std::vector<VirtualLight>& lights) {
    if (const auto light = virtual_light_of(at, stream)) lights.push_back(*light);
}

void store(const WalkScatter& at, std::vector<VirtualLight>& lights) {
    lights.push_back({SurfacePoint{at.p}, at.power, true, at.g, at.d});
}

// Paths that one thread walks at a time.
constexpr std::uint64_t kChunk = 8192;

Walked walk_paths(const Scene& scene, const VirtualLightPlan& plan, std::uint64_t begin, std::uint64_t end) {
    Walked result;
    Emission emission(scene, plan.seed, Purpose::virtual_light, plan.pass, plan.emission);
    emission.for_each(begin, end, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
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
    // Consecutive indices: paths 2^k of a set are a net, and so are all paths of all sets. A chunk is a set,
    // or a part of one: both are powers of 2.
    const std::uint64_t all = std::uint64_t{plan.sets} * plan.paths;
    const std::uint64_t per_chunk = std::min<std::uint64_t>(plan.paths, kChunk);
    std::vector<Walked> walked(all / per_chunk);
    {
        Phase phase(monitor, "virtual lights", all);
        parallel_chunks(workers, static_cast<std::int64_t>(walked.size()), [&](std::int64_t chunk) {
            if (monitor.stopped()) return;
            const std::uint64_t begin = static_cast<std::uint64_t>(chunk) * per_chunk;
            walked[static_cast<std::size_t>(chunk)] = walk_paths(scene, plan, begin, begin + per_chunk);
            phase.advance(per_chunk);
        });
    }
    std::size_t total = 0;
    for (const Walked& part : walked) total += part.lights.size();
    if (total > 0xffffffffU) {
        throw InputError(fmt::format("{} virtual lights are too many; at most {} fit", total, 0xffffffffU));
    }
    VirtualLightSets result;
    result.lights.reserve(total);
    result.begins.push_back(0);
    std::uint64_t paths = 0;
    for (Walked& part : walked) {
        result.lights.insert(result.lights.end(), part.lights.begin(), part.lights.end());
        result.ledger.add(part.ledger);
        part = {};  // the lights are held twice no longer than they must be
        paths += per_chunk;
        if (paths % plan.paths == 0)
            result.begins.push_back(static_cast<std::uint32_t>(result.lights.size()));
    }
    result.ledger.scale(1.0 / (static_cast<double>(plan.sets) * plan.paths));
    return result;
}

}  // namespace lucerna
