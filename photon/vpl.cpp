#include "photon/vpl.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/base/memory.h"
#include "photon/vpl_of_hit.h"

namespace lucerna {
namespace {

// Of some paths in a row.
struct ChunkLights {
    std::vector<Vpl> lights;
    Ledger ledger;
};

void store(const LightPathScatter& at, std::vector<Vpl>& lights) {
    lights.push_back({SurfacePoint{at.p}, at.power, true, at.g, at.d});
}

// Paths that one thread traces at a time.
constexpr std::uint64_t kChunk = 8192;

ChunkLights trace_light_paths(const Scene& scene, const VplParameters& parameters, std::uint64_t begin,
                              std::uint64_t end) {
    ChunkLights result;
    Emission emission(scene, parameters.seed, Purpose::vpl, parameters.pass, parameters.emission);
    emission.for_each(begin, end, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
        ++result.ledger.paths;
        if (!start) {
            ++result.ledger.not_emitted;
            return;
        }
        Sampler sampler = Sampler::stratified(parameters.seed, Purpose::vpl, parameters.pass, path);
        trace_for_vpls(
            scene, *start, parameters.gloss, sampler, result.ledger,
            [&](const LightPathHit& at) {
                make_vpls(at, parameters.gloss, [&](const Vpl& light) { result.lights.push_back(light); });
            },
            [&](const LightPathScatter& at) { store(at, result.lights); });
    });
    return result;
}

// Throws InputError for more VPLs than there is memory for, by what the first chunks' paths left: they are
// held as chunks leave them, in one row, and in the order in which they are asked.
void require_memory_for(const std::vector<ChunkLights>& chunks, std::uint64_t paths, std::uint64_t all) {
    constexpr double kOrdered = 64;
    std::size_t found = 0;
    for (const ChunkLights& part : chunks) found += part.lights.size();
    const double lights = static_cast<double>(found) * static_cast<double>(all) / static_cast<double>(paths);
    require_memory(static_cast<std::uint64_t>(lights * (2 * sizeof(Vpl) + kOrdered)),
                   fmt::format("about {:.2g} virtual point lights from {} light paths", lights, all),
                   "fewer sets, or light paths in a set, are accepted (nsets, nlights)");
}

}  // namespace

VplSets build_vpls(const Scene& scene, const VplParameters& parameters, const Workers& workers,
                   Monitor& monitor) {
    // Consecutive indices: paths 2^k of a set are a net, and so are all paths of all sets. A chunk is a set,
    // or a part of one: both are powers of 2.
    const std::uint64_t all = std::uint64_t{parameters.sets} * parameters.paths;
    constexpr std::uint64_t kMostPaths = std::uint64_t{1} << 32;  // that have a number
    if (all > kMostPaths) {
        throw InputError(
            fmt::format("{} sets of {} light paths are too many; at most {} paths in all can be "
                        "emitted (nsets, nlights)",
                        parameters.sets, parameters.paths, kMostPaths));
    }
    const std::uint64_t per_chunk = std::min<std::uint64_t>(parameters.paths, kChunk);
    std::vector<ChunkLights> chunks(all / per_chunk);
    {
        Phase phase(monitor, "virtual point lights", all);
        const auto trace_chunks = [&](std::uint64_t from, std::uint64_t to) {
            parallel_chunks(workers, static_cast<std::int64_t>(to - from), [&](std::int64_t chunk) {
                if (monitor.stopped()) return;
                const std::uint64_t place = from + static_cast<std::uint64_t>(chunk);
                chunks[place] =
                    trace_light_paths(scene, parameters, place * per_chunk, (place + 1) * per_chunk);
                phase.advance(per_chunk);
            });
        };
        // The first of them tell what all will need.
        const std::uint64_t sample = std::min<std::uint64_t>(chunks.size(), 8 * kChunk / per_chunk);
        trace_chunks(0, sample);
        if (!monitor.stopped()) require_memory_for(chunks, sample * per_chunk, all);
        trace_chunks(sample, chunks.size());
    }
    std::size_t total = 0;
    for (const ChunkLights& part : chunks) total += part.lights.size();
    if (total > 0xffffffffU) {
        throw InputError(
            fmt::format("{} virtual point lights are too many; at most {} fit", total, 0xffffffffU));
    }
    VplSets result;
    result.lights.reserve(total);
    result.begins.push_back(0);
    std::uint64_t paths = 0;
    for (ChunkLights& part : chunks) {
        result.lights.insert(result.lights.end(), part.lights.begin(), part.lights.end());
        result.ledger.add(part.ledger);
        part = {};  // the lights are held twice no longer than they must be
        paths += per_chunk;
        if (paths % parameters.paths == 0)
            result.begins.push_back(static_cast<std::uint32_t>(result.lights.size()));
    }
    result.ledger.scale(1.0 / (static_cast<double>(parameters.sets) * parameters.paths));
    return result;
}

}  // namespace lucerna
