#include "photon/virtual_lights.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "photon/virtual_light_of.h"

namespace lucerna {
namespace {

// Of some paths in a row.
struct Walked {
    std::vector<VirtualLight> lights;
    Ledger ledger;
};

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
        walk_for_lights(
            scene, *start, plan.gloss, stream, result.ledger,
            [&](const WalkHit& at) {
                virtual_lights_of(at, plan.gloss,
                                  [&](const VirtualLight& light) { result.lights.push_back(light); });
            },
            [&](const WalkScatter& at) { store(at, result.lights); });
    });
    return result;
}

// Throws InputError for more virtual lights than there is memory for, by what the first chunks' paths left:
// they are held as chunks leave them, in one row, and in the order in which they are asked.
void require_memory_for(const std::vector<Walked>& walked, std::uint64_t paths, std::uint64_t all) {
    constexpr double kOrdered = 64;
    std::size_t found = 0;
    for (const Walked& part : walked) found += part.lights.size();
    const double lights = static_cast<double>(found) * static_cast<double>(all) / static_cast<double>(paths);
    require_memory(static_cast<std::uint64_t>(lights * (2 * sizeof(VirtualLight) + kOrdered)),
                   fmt::format("about {:.2g} virtual lights from {} light paths", lights, all),
                   "fewer sets, or light paths in a set, are accepted (nsets, nlights)");
}

}  // namespace

VirtualLightSets build_virtual_lights(const Scene& scene, const VirtualLightPlan& plan,
                                      const Workers& workers, Monitor& monitor) {
    // Consecutive indices: paths 2^k of a set are a net, and so are all paths of all sets. A chunk is a set,
    // or a part of one: both are powers of 2.
    const std::uint64_t all = std::uint64_t{plan.sets} * plan.paths;
    constexpr std::uint64_t kMostPaths = std::uint64_t{1} << 32;  // that have a number
    if (all > kMostPaths) {
        throw InputError(
            fmt::format("{} sets of {} light paths are too many; at most {} paths in all can be "
                        "emitted (nsets, nlights)",
                        plan.sets, plan.paths, kMostPaths));
    }
    const std::uint64_t per_chunk = std::min<std::uint64_t>(plan.paths, kChunk);
    std::vector<Walked> walked(all / per_chunk);
    {
        Phase phase(monitor, "virtual lights", all);
        const auto walk_chunks = [&](std::uint64_t from, std::uint64_t to) {
            parallel_chunks(workers, static_cast<std::int64_t>(to - from), [&](std::int64_t chunk) {
                if (monitor.stopped()) return;
                const std::uint64_t place = from + static_cast<std::uint64_t>(chunk);
                walked[place] = walk_paths(scene, plan, place * per_chunk, (place + 1) * per_chunk);
                phase.advance(per_chunk);
            });
        };
        // The first of them tell what all will need.
        const std::uint64_t sample = std::min<std::uint64_t>(walked.size(), 8 * kChunk / per_chunk);
        walk_chunks(0, sample);
        if (!monitor.stopped()) require_memory_for(walked, sample * per_chunk, all);
        walk_chunks(sample, walked.size());
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
