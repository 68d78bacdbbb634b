#include "photon/build_maps.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/system/memory.h"
#include "photon/trace_light_paths.h"

namespace lucerna {
namespace {

constexpr std::int64_t kPathsPerChunk = 4096;  // fixed, so that results do not depend on threads

// Paths are not followed beyond the bounces that the wanted maps can take. Without any map they are followed
// for the ledger.
PathUse use_of(const MapParameters& parameters) {
    const auto wanted = [&](MapKind kind) { return parameters.wanted[static_cast<std::size_t>(kind)]; };
    if (wanted(MapKind::global) || wanted(MapKind::volume)) return PathUse::all;
    if (!wanted(MapKind::caustic)) return wanted(MapKind::direct) ? PathUse::first_hits : PathUse::all;
    return parameters.caustic_chains ? PathUse::caustic_chains : PathUse::caustics;
}

// Stores the photons of one chunk of paths. Chunks are joined in order.
struct ChunkPhotons : LightPathVisitor {
    const MapParameters* parameters = nullptr;
    std::array<Photons, kMapKinds> batches;
    std::array<DepositCount, kMapKinds> counts{};

    ChunkPhotons() = default;
    ChunkPhotons(const MapParameters& of, std::int64_t paths) : parameters(&of) {
        // Reserves memory for a photon of each path: arrays that grow in steps return twice their size to the
        // system, page by page, and threads wait for each other there. Reserved pages that stay empty are
        // never touched.
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
            if (of.wanted[kind]) batches[kind].reserve(static_cast<std::size_t>(paths));
        }
    }

    void hit(const LightPathHit& at) {
        const auto kind = static_cast<std::size_t>(map_of(at.path, parameters->caustic_chains));
        if (!stores_photons(at.bsdf)) {
            ++counts[kind].not_storable;
        } else if (!parameters->wanted[kind]) {
            ++counts[kind].not_wanted;
        } else {
            ++counts[kind].stored;
            batches[kind].add_hit(at.hit.at, at.d, at.power, at.start.light, at.start.cell, at.path.bounces(),
                                  at.path.strayed);
        }
    }
    template <typename Archive>
    void fields(Archive& archive) {
        archive(ledger, batches, counts);
    }
    void scatter(const LightPathScatter& at) {
        const auto kind = static_cast<std::size_t>(MapKind::volume);
        const bool direct = at.path.bounces() == 0;
        if (!parameters->wanted[kind] || (direct && !parameters->volume_direct)) {
            ++counts[kind].not_wanted;
        } else {
            ++counts[kind].stored;
            batches[kind].add(at.p, PackedDirection(),
                              {PackedDirection(at.d), at.power, at.start.light, at.start.cell, true},
                              at.path.bounces());
        }
    }
};

LightPathRequest light_paths(const MapParameters& parameters, std::int64_t count) {
    LightPathRequest paths;
    paths.count = count;
    paths.seed = parameters.seed;
    paths.pass = parameters.pass;
    paths.emission = parameters.emission;
    paths.specular_below = parameters.specular_below;
    paths.use = use_of(parameters);
    paths.longest = parameters.longest;
    paths.per_chunk = kPathsPerChunk;
    return paths;
}

// Concatenates the chunks' photons of one class, freeing each as it goes.
Photons join(std::vector<ChunkPhotons>& chunks, std::size_t kind, std::int64_t paths,
             const Workers& workers) {
    const float share = 1.0F / static_cast<float>(paths);  // 1/M of [Jensen 2001, 5.1]; paths >= 1
    std::vector<std::size_t> begins;
    std::size_t total = 0;
    for (const ChunkPhotons& h : chunks) {
        begins.push_back(total);
        total += h.batches[kind].size();
    }
    Photons all;
    all.resize(total);
    parallel_chunks(workers, static_cast<std::int64_t>(chunks.size()), [&](std::int64_t chunk) {
        const Photons batch = std::exchange(chunks[static_cast<std::size_t>(chunk)].batches[kind], {});
        const auto begin = static_cast<std::ptrdiff_t>(begins[static_cast<std::size_t>(chunk)]);
        std::copy(batch.positions.begin(), batch.positions.end(), all.positions.begin() + begin);
        std::copy(batch.normals.begin(), batch.normals.end(), all.normals.begin() + begin);
        std::copy(batch.bounces.begin(), batch.bounces.end(), all.bounces.begin() + begin);
        std::transform(batch.photons.begin(), batch.photons.end(), all.photons.begin() + begin,
                       [share](Photon photon) {
                           photon.power *= share;
                           return photon;
                       });
    });
    return all;
}

std::int64_t stored(const std::vector<ChunkPhotons>& chunks, std::size_t kind) {
    std::int64_t sum = 0;
    for (const ChunkPhotons& h : chunks) sum += static_cast<std::int64_t>(h.counts[kind].stored);
    return sum;
}

// Returns the peak memory, in bytes, for building maps with `all` photons in total and `largest` in the
// largest map. It counts each photon twice (in the chunks, whose memory the system does not get back at once,
// and in its map) plus the tree, and one map at a time in its original order with the permutation. Measured:
// 142 bytes per photon of two maps; this estimate is 139.
double bytes_of_maps(double all, double largest) {
    constexpr double kBytesOfHit =
        sizeof(V3f) + sizeof(PackedDirection) + sizeof(Photon) + sizeof(BounceCount);
    constexpr double kTree = 24, kOrder = sizeof(std::uint32_t) + sizeof(PackedDirection);
    return all * (2 * kBytesOfHit + kTree) + largest * (kBytesOfHit + kOrder);
}

// Throws InputError if the memory does not suffice for the photons of the paths still to be traced, up to
// `total`, in `sets` sets of maps. They are extrapolated from the first `done` paths.
void require_memory_for_maps(const std::vector<ChunkPhotons>& chunks, std::int64_t done, std::int64_t total,
                             int sets) {
    double all = 0, largest = 0;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const double photons = expected_of(
            chunks, done, total - done, [&](const ChunkPhotons& chunk) { return chunk.counts[kind].stored; });
        all += photons;
        largest = std::max(largest, photons);
    }
    require_memory(
        static_cast<std::uint64_t>(sets * bytes_of_maps(all, largest)),
        fmt::format("photon maps of about {:.2g} photons from {} light paths", sets * all, sets * total),
        "use fewer photons, or the integrator progressive, which traces them in passes");
}

// Continues until `total` light paths are traced.
void trace_until(const Scene& scene, const MapParameters& parameters, std::int64_t total,
                 const Workers& workers, Monitor& monitor, std::vector<ChunkPhotons>& chunks) {
    trace_light_paths(
        {scene, workers, monitor}, light_paths(parameters, total), chunks,
        [&](std::int64_t count) { return ChunkPhotons(parameters, count); },
        [&](const std::vector<ChunkPhotons>& traced, std::int64_t done, std::int64_t all) {
            const int ranks = workers.ranks ? workers.ranks->on_this_host() : 1;
            require_memory_for_maps(traced, done, all, parameters.sets * ranks);
        });
}

// Returns the number of paths to trace, given the mean length of those of the first chunk: at least that
// chunk and at most parameters.paths.
std::int64_t within_bounces(const MapParameters& parameters, const std::vector<ChunkPhotons>& chunks,
                            Monitor& monitor) {
    Ledger first;
    for (const ChunkPhotons& h : chunks) first.add(h.ledger);
    if (first.paths == 0) return parameters.paths;
    const double length =
        static_cast<double>(first.hits + first.scatterings) / static_cast<double>(first.paths);
    if (!(length > parameters.most_mean_bounces)) return parameters.paths;
    const double affordable = static_cast<double>(parameters.paths) * parameters.most_mean_bounces / length;
    const auto whole_chunks =
        std::max<std::int64_t>(static_cast<std::int64_t>(affordable) / kPathsPerChunk, 1);
    const std::int64_t paths = std::min(parameters.paths, whole_chunks * kPathsPerChunk);
    if (paths < parameters.paths) {
        monitor.warn(
            fmt::format("only {1} of {0} light paths are traced: they bounce {2:.0f} times on average, "
                        "because the surfaces absorb almost nothing; the result is noisier",
                        parameters.paths, paths, length));
    }
    return paths;
}

// Returns the number of paths that all targets are expected to need, extrapolated from the first `total`, or
// `total` if they are met. Drops the targets that would need more than `most` paths.
std::int64_t needed(const std::vector<ChunkPhotons>& chunks, std::int64_t total, std::int64_t most,
                    std::array<std::int64_t, kMapKinds>& targets, Monitor& monitor) {
    std::int64_t paths = total;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        const std::int64_t found = stored(chunks, kind);
        if (found >= targets[kind]) continue;
        const double wanted = 1.1 * static_cast<double>(total) * static_cast<double>(targets[kind]) /
                              static_cast<double>(std::max<std::int64_t>(found, 1));
        if (wanted > static_cast<double>(most)) {
            monitor.warn(
                fmt::format("the {} map holds {} photons after {} light paths; the target of {} is abandoned",
                            map_name(static_cast<MapKind>(kind)), found, total, targets[kind]));
            targets[kind] = 0;
            continue;
        }
        paths = std::max(paths, static_cast<std::int64_t>(wanted));
    }
    return (paths + kPathsPerChunk - 1) / kPathsPerChunk * kPathsPerChunk;
}

// Bounds the total number of light paths by the pace so far and the deadline. A first sample of few paths is
// never extrapolated to more than sixteen times as many.
class PathBudget {
  public:
    PathBudget(const Deadline& deadline, const Workers& workers)
        : workers_(workers),
          limited_(deadline.exists()),
          time_(agreed(workers, limited_ ? kTracing * deadline.left() : 0)) {}

    // Returns a number of whole chunks; `paths` or 16 * `done` if the deadline allows that many. Collective.
    std::int64_t allowed(std::int64_t done, std::int64_t paths) const {
        const std::int64_t next = std::min(paths, kMostGrowth * done);
        if (!limited_) return next;
        const double pace = static_cast<double>(done) / std::max(agreed(workers_, clock_.seconds()), 1e-9);
        const double in_time = pace * time_;
        if (in_time >= static_cast<double>(next)) return next;
        return static_cast<std::int64_t>(in_time) / kPathsPerChunk * kPathsPerChunk;
    }

  private:
    // Indexing takes a third to two thirds of the time of tracing.
    static constexpr double kTracing = 0.6;
    static constexpr std::int64_t kMostGrowth = 16;

    const Workers& workers_;
    bool limited_;
    double time_;  // seconds
    Stopwatch clock_;
};

// Traces at most `most` paths before the deadline; returns their number.
std::int64_t trace_in_time(const Scene& scene, const MapParameters& parameters, std::int64_t most,
                           const Workers& workers, Monitor& monitor, std::vector<ChunkPhotons>& chunks) {
    const PathBudget budget(parameters.deadline, workers);
    const int threads = workers.ranks ? workers.ranks->all_threads() : workers.threads;
    std::int64_t done = 0, next = std::min(most, kPathsPerChunk * threads);
    while (done < next && !monitor.stopped()) {
        trace_until(scene, parameters, next, workers, monitor, chunks);
        done = next;
        next = budget.allowed(done, most);
    }
    return done;
}

// Traces light paths until the targets are met or the deadline has come; returns their number.
std::int64_t trace_to_targets(const Scene& scene, const MapParameters& parameters,
                              std::array<std::int64_t, kMapKinds> targets, const Workers& workers,
                              Monitor& monitor, std::vector<ChunkPhotons>& chunks) {
    constexpr std::int64_t kFirstPaths = 16 * kPathsPerChunk;
    constexpr std::int64_t kMostPaths = std::int64_t{1} << 27;  // minutes, and gigabytes
    const PathBudget budget(parameters.deadline, workers);
    std::int64_t done = 0, next = kFirstPaths;
    while (done < next) {
        trace_until(scene, parameters, next, workers, monitor, chunks);
        done = next;
        if (monitor.stopped()) break;
        next = budget.allowed(done, needed(chunks, done, kMostPaths, targets, monitor));
    }
    return done;
}

// Traces as many light paths as the parameters ask for; returns their number.
std::int64_t trace_all(const Scene& scene, const MapParameters& parameters, const Workers& workers,
                       Monitor& monitor, std::vector<ChunkPhotons>& chunks) {
    std::array<std::int64_t, kMapKinds> targets = parameters.targets;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!parameters.wanted[kind]) targets[kind] = 0;
    }
    if (targets != std::array<std::int64_t, kMapKinds>{})
        return trace_to_targets(scene, parameters, targets, workers, monitor, chunks);
    std::int64_t paths = parameters.paths;
    if (parameters.most_mean_bounces > 0 && paths > kPathsPerChunk) {
        trace_until(scene, parameters, kPathsPerChunk, workers, monitor, chunks);
        paths = within_bounces(parameters, chunks, monitor);
    }
    if (parameters.deadline.exists())
        return trace_in_time(scene, parameters, paths, workers, monitor, chunks);
    if (paths > static_cast<std::int64_t>(chunks.size()) * kPathsPerChunk) {
        trace_until(scene, parameters, paths, workers, monitor, chunks);
    }
    return paths;
}

}  // namespace

PhotonMaps build_photon_maps(const Scene& scene, const MapParameters& parameters, const Workers& workers,
                             Monitor& monitor) {
    require_path_numbers("photons", parameters.paths);
    PhotonMaps result;

    // Emit and trace light paths.
    const Stopwatch tracing;
    std::vector<ChunkPhotons> chunks;
    const std::int64_t paths = trace_all(scene, parameters, workers, monitor, chunks);
    for (const ChunkPhotons& h : chunks) {
        result.ledger.add(h.ledger);
        for (std::size_t kind = 0; kind < kMapKinds; ++kind) result.counts[kind].add(h.counts[kind]);
    }
    result.ledger.scale(1.0 / static_cast<double>(std::max<std::int64_t>(paths, 1)));  // 0 if stopped at once
    result.seconds_trace = tracing.seconds();

    // Index.
    const Stopwatch indexing;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!parameters.wanted[kind]) continue;
        result.maps[kind].emplace(join(chunks, kind, paths, workers), parameters.index, workers);
    }
    result.seconds_index = indexing.seconds();
    return result;
}

Facts map_facts(const MapParameters& parameters) {
    Facts facts{{"seed", fmt::format("{}", parameters.seed)}, {"pass", fmt::format("{}", parameters.pass)}};
    std::vector<std::string_view> maps;
    bool targets = false;
    for (std::size_t kind = 0; kind < kMapKinds; ++kind) {
        if (!parameters.wanted[kind]) continue;
        const std::string_view name = map_name(static_cast<MapKind>(kind));
        maps.push_back(name);
        if (parameters.targets[kind] == 0) continue;
        targets = true;
        facts.emplace_back(fmt::format("target of the {} map", name),
                           fmt::format("{}", parameters.targets[kind]));
    }
    facts.emplace_back("number of light paths",
                       targets ? "as the targets need" : fmt::format("{}", parameters.paths));
    facts.emplace_back("list of maps", fmt::format("{}", fmt::join(maps, ", ")));
    facts.emplace_back("volume map", parameters.volume_direct ? "with direct light" : "without direct light");
    facts.emplace_back("largest alpha that counts as specular", fmt::format("{}", parameters.specular_below));
    facts.emplace_back("longest path before a photon", fmt::format("{}", parameters.longest));
    return facts;
}

namespace {

// Records the ray of each segment at its end.
struct RaysOfPaths : LightPathVisitor {
    SurfacePoint from;  // where the current segment begins
    std::vector<Ray> rays;

    bool begin(std::uint32_t /*path*/, const std::optional<LightPathStart>& start,
               const Sampler& /*sampler*/) {
        if (start) from = start->from;
        return true;
    }
    void hit(const LightPathHit& at) {
        note(at.d);
        from = at.hit.at;
    }
    void scatter(const LightPathScatter& at) {
        note(at.d);
        from = SurfacePoint{at.p};
    }
    void escape(const LightPathEscape& at) { note(at.d); }

  private:
    void note(const V3f& d) { rays.push_back({from.towards(d), d}); }
};

}  // namespace

std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapParameters& parameters) {
    LightPathRequest paths;
    paths.count = parameters.paths;
    paths.seed = parameters.seed;
    paths.pass = parameters.pass;
    paths.specular_below = parameters.specular_below;
    paths.interleaved = false;  // a segment begins where the one before it ended
    RaysOfPaths visitor;
    trace_chunk(scene, paths, samplers_of(paths), 0, paths.count, visitor);
    return std::move(visitor.rays);
}

}  // namespace lucerna
