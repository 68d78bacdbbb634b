#include "photon/build_maps.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/memory.h"
#include "engine/base/stopwatch.h"
#include "photon/walk_group.h"

namespace lucerna {
namespace {

// What one chunk of paths makes; joined in the order of the chunks.
struct Harvest {
    std::array<Photons, kMapKinds> batches;
    std::array<DepositCount, kMapKinds> counts{};
    Ledger ledger;
};

void deposit(const WalkHit& at, const MapPlan& plan, Harvest& harvest) {
    const auto kind = static_cast<std::size_t>(map_of(at.path, plan.caustic_chains));
    if (!stores_photons(at.bsdf)) {
        ++harvest.counts[kind].not_storable;
    } else if (!plan.wanted[kind]) {
        ++harvest.counts[kind].not_wanted;
    } else {
        ++harvest.counts[kind].stored;
        const V3f& n = at.hit.at.n;
        harvest.batches[kind].add(at.hit.at.p, PackedDirection(n.dot(at.d) > 0 ? -n : n),
                                  {PackedDirection(at.d), at.power, at.start.light, at.start.cell});
    }
}

void deposit(const WalkScatter& at, const MapPlan& plan, Harvest& harvest) {
    const auto kind = static_cast<std::size_t>(MapKind::volume);
    const bool direct = at.path.diffuse == 0 && at.path.specular == 0;
    if (!plan.wanted[kind] || (direct && !plan.volume_direct)) {
        ++harvest.counts[kind].not_wanted;
    } else {
        ++harvest.counts[kind].stored;
        harvest.batches[kind].add(at.p, PackedDirection(),
                                  {PackedDirection(at.d), at.power, at.start.light, at.start.cell});
    }
}

// What is beyond the bounces that wanted maps can take is not walked. Without any map the ledger is what is
// wanted.
PathUse use_of(const MapPlan& plan) {
    const auto wanted = [&](MapKind kind) { return plan.wanted[static_cast<std::size_t>(kind)]; };
    if (wanted(MapKind::global) || wanted(MapKind::volume)) return PathUse::all;
    if (!wanted(MapKind::caustic)) return wanted(MapKind::direct) ? PathUse::first_hits : PathUse::all;
    return plan.caustic_chains ? PathUse::caustic_chains : PathUse::caustics;
}

Harvest walk_paths(const Scene& scene, const MapPlan& plan, std::int64_t begin, std::int64_t end) {
    Harvest harvest;
    // Room for a photon of each path: arrays that grow in steps leave twice their size to the system, page by
    // page, and threads wait for each other there. What is not filled is never touched.
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (plan.wanted[kind]) harvest.batches[kind].reserve(static_cast<std::size_t>(end - begin));
    }
    Emission emission(scene, plan.seed, Purpose::emission, plan.pass, plan.emission);
    const StreamFamily numbers(plan.seed, Purpose::emission, plan.pass);
    WalkGroup group(
        scene, harvest.ledger, [&](const WalkHit& at) { deposit(at, plan, harvest); },
        [&](const WalkScatter& at) { deposit(at, plan, harvest); }, [](const WalkExit&) {},
        plan.specular_below, use_of(plan));
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          ++harvest.ledger.paths;
                          if (start) {
                              group.add(*start, numbers.path(path));
                          } else {
                              ++harvest.ledger.not_emitted;
                          }
                      });
    group.finish();
    return harvest;
}

// Concatenates the chunks' photons of one class, freeing each as it goes.
Photons join(std::vector<Harvest>& harvests, std::size_t kind, std::int64_t paths, const Workers& workers) {
    const float share = 1.0F / static_cast<float>(paths);  // the one place of 1/M; paths >= 1
    std::vector<std::size_t> begins;
    std::size_t total = 0;
    for (const Harvest& h : harvests) {
        begins.push_back(total);
        total += h.batches[kind].size();
    }
    Photons all;
    all.positions.resize(total);
    all.normals.resize(total);
    all.photons.resize(total);
    parallel_chunks(workers, static_cast<std::int64_t>(harvests.size()), [&](std::int64_t chunk) {
        const Photons batch = std::exchange(harvests[static_cast<std::size_t>(chunk)].batches[kind], {});
        const auto begin = static_cast<std::ptrdiff_t>(begins[static_cast<std::size_t>(chunk)]);
        std::copy(batch.positions.begin(), batch.positions.end(), all.positions.begin() + begin);
        std::copy(batch.normals.begin(), batch.normals.end(), all.normals.begin() + begin);
        std::transform(batch.photons.begin(), batch.photons.end(), all.photons.begin() + begin,
                       [share](Photon photon) {
                           photon.power *= share;
                           return photon;
                       });
    });
    return all;
}

constexpr std::int64_t kPathsPerChunk =
    4096;  // paths per chunk; fixed, so that results do not depend on threads

std::int64_t stored(const std::vector<Harvest>& harvests, std::size_t kind) {
    std::int64_t sum = 0;
    for (const Harvest& h : harvests) sum += static_cast<std::int64_t>(h.counts[kind].stored);
    return sum;
}

// Bytes at the most while maps are made, of so many photons in all and in the largest map: as chunks leave
// them (which the system does not get back at once) and in their maps, under the tree; one map at a time as
// it landed and in its order, too. Measured: 142 bytes for a photon of two maps, where this says 139.
double bytes_of_maps(double all, double largest) {
    constexpr double kLanded = sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon);
    constexpr double kTree = 24, kOrder = sizeof(std::uint32_t) + sizeof(PackedDirection);
    return all * (2 * kLanded + kTree) + largest * (kLanded + kOrder);
}

// Throws InputError if `total` paths will store more photons than there is memory for, by what the first
// `done` stored.
void require_memory_for(const std::vector<Harvest>& harvests, std::int64_t done, std::int64_t total) {
    if (done <= 0 || total <= done) return;
    double all = 0, largest = 0;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const double photons = static_cast<double>(stored(harvests, kind)) *
                               static_cast<double>(total - done) / static_cast<double>(done);
        all += photons;
        largest = std::max(largest, photons);
    }
    require_memory(static_cast<std::uint64_t>(bytes_of_maps(all, largest)),
                   fmt::format("photon maps of about {:.2g} photons from {} light paths", all, total),
                   "fewer photons are accepted; many of them one after the other: integrator progressive");
}

// Walks paths until there are `total` of them.
void walk_until(const Scene& scene, const MapPlan& plan, std::int64_t total, const Workers& workers,
                Monitor& monitor, std::vector<Harvest>& harvests) {
    const std::int64_t first = static_cast<std::int64_t>(harvests.size()) * kPathsPerChunk;
    harvests.resize(static_cast<std::size_t>((total + kPathsPerChunk - 1) / kPathsPerChunk));
    Phase phase(monitor, "photons", static_cast<std::uint64_t>(total - first));
    const auto walk = [&](std::int64_t from, std::int64_t to) {
        parallel_ranges(workers, to - from, kPathsPerChunk,
                        [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
                            if (monitor.stopped()) return;
                            harvests[static_cast<std::size_t>((from + begin) / kPathsPerChunk)] =
                                walk_paths(scene, plan, from + begin, from + end);
                            phase.advance(static_cast<std::uint64_t>(end - begin));
                        });
    };
    // The first of them tell what all will need.
    const std::int64_t sample = std::min(total, std::max(first, 16 * kPathsPerChunk));
    walk(first, sample);
    if (!monitor.stopped()) require_memory_for(harvests, sample, total);
    walk(sample, total);
}

// How many paths are walked, by the length of those of the first chunk: never fewer than that chunk, nor more
// than planned.
std::int64_t within_bounces(const MapPlan& plan, const std::vector<Harvest>& harvests, Monitor& monitor) {
    Ledger first;
    for (const Harvest& h : harvests) first.add(h.ledger);
    if (first.paths == 0) return plan.paths;
    const double length =
        static_cast<double>(first.hits + first.scatterings) / static_cast<double>(first.paths);
    if (!(length > plan.most_bounces)) return plan.paths;
    const double affordable = static_cast<double>(plan.paths) * plan.most_bounces / length;
    const auto chunks = std::max<std::int64_t>(static_cast<std::int64_t>(affordable) / kPathsPerChunk, 1);
    const std::int64_t paths = std::min(plan.paths, chunks * kPathsPerChunk);
    if (paths < plan.paths) {
        monitor.warn(fmt::format(
            "of {} light paths {} are walked: they bounce {:.0f} times on average, as surfaces that "
            "light goes on from take almost nothing away; what they bring has more noise",
            plan.paths, paths, length));
    }
    return paths;
}

// How many paths all targets are expected to need, by what the first `total` gave; `total` if they are met.
// Drops the targets that would need more paths than `most`.
std::int64_t needed(const std::vector<Harvest>& harvests, std::int64_t total, std::int64_t most,
                    std::array<std::int64_t, kMapKinds>& targets, Monitor& monitor) {
    std::int64_t paths = total;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const std::int64_t found = stored(harvests, kind);
        if (found >= targets[kind]) continue;
        const double wanted = 1.1 * static_cast<double>(total) * static_cast<double>(targets[kind]) /
                              static_cast<double>(std::max<std::int64_t>(found, 1));
        if (wanted > static_cast<double>(most)) {
            monitor.warn(
                fmt::format("the {} map holds {} photons after {} light paths; the target of {} is given up",
                            map_name(static_cast<MapKind>(kind)), found, total, targets[kind]));
            targets[kind] = 0;
            continue;
        }
        paths = std::max(paths, static_cast<std::int64_t>(wanted));
    }
    return (paths + kPathsPerChunk - 1) / kPathsPerChunk * kPathsPerChunk;
}

// Walks as many paths as the plan asks for; returns their number.
std::int64_t walk_all(const Scene& scene, const MapPlan& plan, const Workers& workers, Monitor& monitor,
                      std::vector<Harvest>& harvests) {
    std::array<std::int64_t, kMapKinds> targets = plan.targets;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!plan.wanted[kind]) targets[kind] = 0;
    }
    if (targets == std::array<std::int64_t, kMapKinds>{}) {
        std::int64_t paths = plan.paths;
        if (plan.most_bounces > 0 && paths > kPathsPerChunk) {
            walk_until(scene, plan, kPathsPerChunk, workers, monitor, harvests);
            paths = within_bounces(plan, harvests, monitor);
        }
        if (paths > static_cast<std::int64_t>(harvests.size()) * kPathsPerChunk) {
            walk_until(scene, plan, paths, workers, monitor, harvests);
        }
        return paths;
    }
    constexpr std::int64_t kPilot = 16 * kPathsPerChunk;
    constexpr std::int64_t kMostPaths = std::int64_t{1} << 27;  // minutes, and gigabytes
    std::int64_t total = kPilot;
    walk_until(scene, plan, total, workers, monitor, harvests);
    while (!monitor.stopped()) {
        // A first look at few photons is not trusted with more than sixteen times as many paths.
        const std::int64_t next = std::min(needed(harvests, total, kMostPaths, targets, monitor), 16 * total);
        if (next <= total) break;
        total = next;
        walk_until(scene, plan, total, workers, monitor, harvests);
    }
    return total;
}

}  // namespace

PhotonMaps build_photon_maps(const Scene& scene, const MapPlan& plan, const Workers& workers,
                             Monitor& monitor) {
    if (plan.paths < 1 || plan.paths > (std::int64_t{1} << 32)) {
        throw InputError(
            fmt::format("photons: {} paths asked for; 1 to 4294967296 can be emitted", plan.paths));
    }
    PhotonMaps result;

    // Emit and walk.
    const Stopwatch tracing;
    std::vector<Harvest> harvests;
    const std::int64_t paths = walk_all(scene, plan, workers, monitor, harvests);
    for (const Harvest& h : harvests) {
        result.ledger.add(h.ledger);
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            result.counts[kind].stored += h.counts[kind].stored;
            result.counts[kind].not_wanted += h.counts[kind].not_wanted;
            result.counts[kind].not_storable += h.counts[kind].not_storable;
        }
    }
    result.ledger.scale(1.0 / static_cast<double>(paths));
    result.seconds_trace = tracing.seconds();

    // Index.
    const Stopwatch indexing;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!plan.wanted[kind]) continue;
        result.maps[kind].emplace(join(harvests, kind, paths, workers), plan.index, workers);
    }
    result.seconds_index = indexing.seconds();
    return result;
}

std::uint64_t map_key(const Scene& scene, const MapPlan& plan) {
    WordHash key;
    key.add(static_cast<std::uint64_t>(plan.paths));
    key.add(plan.seed);
    key.add(std::uint64_t{plan.pass});
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        key.add(int{plan.wanted[kind]});
        key.add(static_cast<std::uint64_t>(plan.targets[kind]));
    }
    key.add(int{plan.volume_direct});
    key.add(plan.specular_below);
    if (plan.emission) key.add(plan.emission->hash());

    MapPlan all = plan;
    all.wanted.fill(true);
    const Harvest first = walk_paths(scene, all, 0, kPathsPerChunk);
    for (const Photons& batch : first.batches) {
        key.add_bytes(std::as_bytes(std::span(batch.positions)));
        key.add_bytes(std::as_bytes(std::span(batch.photons)));
    }
    for (const V3d& flux : {first.ledger.emitted, first.ledger.absorbed, first.ledger.escaped}) {
        for (int c = 0; c < 3; ++c) key.add(flux[c]);
    }
    return key.value();
}

}  // namespace lucerna
