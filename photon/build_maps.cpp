#include "photon/build_maps.h"

#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"

namespace lucerna {
namespace {

// What one chunk of paths makes; joined in the order of the chunks.
struct Harvest {
    std::array<Photons, kMapKinds> batches;
    std::array<DepositCount, kMapKinds> counts{};
    Ledger ledger;
};

void deposit(const WalkHit& at, const MapPlan& plan, float share, Harvest& harvest) {
    const auto kind = static_cast<std::size_t>(map_of(at.path));
    if (!stores_photons(at.bsdf)) {
        ++harvest.counts[kind].not_storable;
    } else if (!plan.wanted[kind]) {
        ++harvest.counts[kind].not_wanted;
    } else {
        ++harvest.counts[kind].stored;
        const V3f& n = at.hit.at.n;
        harvest.batches[kind].add(at.hit.at.p, PackedDirection(n.dot(at.d) > 0 ? -n : n),
                                  {PackedDirection(at.d), at.power * share, at.start.light, at.start.cell});
    }
}

Harvest walk_paths(const Scene& scene, const MapPlan& plan, std::int64_t begin, std::int64_t end) {
    Harvest harvest;
    const float share = 1.0F / static_cast<float>(plan.paths);  // the one place of 1/M; paths >= 1
    for (std::int64_t path = begin; path < end; ++path) {
        Stream stream =
            Stream::stratified(plan.seed, Purpose::emission, plan.pass, static_cast<std::uint32_t>(path));
        ++harvest.ledger.paths;
        const auto start = emit_path(scene, stream);
        if (!start) {
            ++harvest.ledger.not_emitted;
            continue;
        }
        walk(scene, *start, stream, harvest.ledger,
             [&](const WalkHit& at) { deposit(at, plan, share, harvest); });
    }
    return harvest;
}

// Concatenates the chunks' photons of one class, freeing each as it goes.
Photons join(std::vector<Harvest>& harvests, std::size_t kind) {
    std::size_t total = 0;
    for (const Harvest& h : harvests) total += h.batches[kind].size();
    Photons all;
    all.reserve(total);
    for (Harvest& h : harvests) {
        const Photons batch = std::exchange(h.batches[kind], {});
        for (std::size_t i = 0; i < batch.size(); ++i)
            all.add(batch.positions[i], batch.normals[i], batch.photons[i]);
    }
    return all;
}

}  // namespace

PhotonMaps build_photon_maps(const Scene& scene, const MapPlan& plan, const Workers& workers,
                             Monitor& monitor) {
    if (plan.paths < 1 || plan.paths > (std::int64_t{1} << 32)) {
        throw InputError(
            fmt::format("photons: {} paths asked for; 1 to 4294967296 can be emitted", plan.paths));
    }
    constexpr std::int64_t kGrain = 4096;  // paths per chunk; fixed, so that results do not depend on threads
    PhotonMaps result;

    // Emit and walk.
    const Stopwatch tracing;
    std::vector<Harvest> harvests(static_cast<std::size_t>((plan.paths + kGrain - 1) / kGrain));
    {
        Phase phase(monitor, "photons", static_cast<std::uint64_t>(plan.paths));
        parallel_ranges(workers, plan.paths, kGrain,
                        [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                            if (monitor.stopped()) return;
                            harvests[static_cast<std::size_t>(chunk)] = walk_paths(scene, plan, begin, end);
                            phase.advance(static_cast<std::uint64_t>(end - begin));
                        });
    }
    for (const Harvest& h : harvests) {
        result.ledger.add(h.ledger);
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            result.counts[kind].stored += h.counts[kind].stored;
            result.counts[kind].not_wanted += h.counts[kind].not_wanted;
            result.counts[kind].not_storable += h.counts[kind].not_storable;
        }
    }
    result.ledger.scale(1.0 / static_cast<double>(plan.paths));
    result.seconds_trace = tracing.seconds();

    // Index.
    const Stopwatch indexing;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!plan.wanted[kind]) continue;
        result.maps[kind].emplace(join(harvests, kind));
    }
    result.seconds_index = indexing.seconds();
    return result;
}

}  // namespace lucerna
