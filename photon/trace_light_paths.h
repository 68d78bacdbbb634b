// The common driver of light paths: emits them, traces them and passes their events to visitors. Photon maps
// [Jensen 2001, 5], virtual point lights [Keller 1997], guides, importance pre-passes and luminaires are all
// visitors of the same paths.
//
// The work is divided into chunks of a fixed number of paths, so that results do not depend on the number of
// threads. Each chunk has its own visitor, and the visitors in order are the result. The ranks of a parallel
// job share the chunks, and each gets all visitors.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/ranks/shared_work.h"
#include "photon/light_path_group.h"

namespace lucerna {

inline constexpr std::int64_t kFirstPaths = 65'536;  // whose memory predicts that of all

// Says which paths are traced.
struct LightPathRequest : LightPathLimits {
    std::int64_t first = 0;  // index of the first path
    std::int64_t count = 0;  // total, including chunks traced before; first + count <= 2^32
    std::uint64_t seed = 0;
    Purpose purpose = Purpose::emission;
    std::uint32_t pass = 0;
    const LearnedEmission* emission = nullptr;  // density of emission; null: by the lights' power
    std::int64_t per_chunk = 4096;              // divides kFirstPaths
    // Traces several paths at a time, which is faster, but visitors see their hits in turns. Otherwise one by
    // one.
    bool interleaved = true;
    std::string_view phase = "photons";  // name in progress reports
};

// Returns the random numbers of all paths. They are made once, since a chunk may be as small as a few paths.
inline SamplerFamily samplers_of(const LightPathRequest& paths) {
    return {paths.seed, paths.purpose, paths.pass};
}

// Traces the paths [begin, end) for one visitor, in the calling thread.
template <typename Visitor>
void trace_chunk(const Scene& scene, const LightPathRequest& paths, const SamplerFamily& samplers,
                 std::int64_t begin, std::int64_t end, Visitor& visitor) {
    Emission emission(scene, paths.seed, paths.purpose, paths.pass, paths.emission);
    LightPathGroup<Visitor> group(scene, paths, visitor);
    emission.for_each(static_cast<std::uint64_t>(begin), static_cast<std::uint64_t>(end),
                      [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
                          ++visitor.ledger.paths;
                          if (!start) ++visitor.ledger.not_emitted;
                          const Sampler sampler = samplers.path(path);
                          if (!visitor.begin(path, start, sampler) || !start) return;
                          if (paths.interleaved) {
                              group.add(*start, sampler);
                          } else {
                              trace_light_path(scene, *start, sampler, paths, visitor);
                          }
                      });
    group.finish();
}

// Throws InputError unless `paths`, which `what` asks for, is in the range of path numbers.
inline void require_path_numbers(std::string_view what, std::int64_t paths) {
    constexpr std::int64_t kMostPaths = std::int64_t{1} << 32;
    if (paths >= 1 && paths <= kMostPaths) return;
    throw InputError(fmt::format("{}: {} light paths; expected 1 to {}", what, paths, kMostPaths));
}

// Extrapolates from the first `done` paths, whose visitors each hold count_of(visitor) items, to the number
// of items of `paths` paths.
template <typename Visitor, typename CountOf>
double expected_of(const std::vector<Visitor>& chunks, std::int64_t done, std::int64_t paths,
                   CountOf&& count_of) {
    std::uint64_t found = 0;
    for (const Visitor& chunk : chunks) found += count_of(chunk);
    return static_cast<double>(found) * static_cast<double>(paths) / static_cast<double>(done);
}

// The scene in which light paths are traced, the threads and ranks that trace them, and their monitor.
struct LightPathWork {
    const Scene& scene;
    const Workers& workers;
    Monitor& monitor;
};

// Continues until paths.count light paths are traced: `chunks` holds the visitors of the whole chunks traced
// before, and receives those of all others. make_visitor(n) makes the visitor of a chunk of n paths. The
// memory of the first 65,536 paths predicts that of all (expected_of): require_memory(chunks, done,
// count), with done > 0, throws InputError if there is less. If the monitor stops it early, visitors of
// untraced chunks are default-constructed, and the caller must not use the result.
template <typename Visitor, typename MakeVisitor, typename RequireMemory>
void trace_light_paths(const LightPathWork& work, const LightPathRequest& paths, std::vector<Visitor>& chunks,
                       MakeVisitor&& make_visitor, RequireMemory&& require_memory) {
    assert(kFirstPaths % paths.per_chunk == 0);  // or the sample would not consist of whole chunks
    const std::int64_t traced_before = static_cast<std::int64_t>(chunks.size()) * paths.per_chunk;
    chunks.resize(static_cast<std::size_t>((paths.count + paths.per_chunk - 1) / paths.per_chunk));
    const SamplerFamily samplers = samplers_of(paths);
    Phase phase(work.monitor, paths.phase, static_cast<std::uint64_t>(paths.count - traced_before));
    const auto trace = [&](std::int64_t from, std::int64_t to) {
        const std::int64_t first_chunk = from / paths.per_chunk;
        const auto begin_of = [&](std::int64_t chunk) { return from + chunk * paths.per_chunk; };
        const auto end_of = [&](std::int64_t chunk) { return std::min(to, begin_of(chunk + 1)); };
        const auto visitor_of = [&](std::int64_t chunk) -> Visitor& {
            return chunks[static_cast<std::size_t>(first_chunk + chunk)];
        };
        constexpr bool kIsShared = requires(Visitor & v, Packer & p) {
            v.fields(p);
        };
        std::atomic<std::int64_t> reported{0};
        shared_chunks(
            kIsShared ? work.workers : work.workers.alone(), paths.phase,
            (to - from + paths.per_chunk - 1) / paths.per_chunk, ResultsGo::to_all_ranks,
            [&](std::int64_t chunk) {
                if (work.monitor.stopped()) return;
                Visitor visitor = make_visitor(end_of(chunk) - begin_of(chunk));
                trace_chunk(work.scene, paths, samplers, paths.first + begin_of(chunk),
                            paths.first + end_of(chunk), visitor);
                visitor_of(chunk) = std::move(visitor);
            },
            [&](std::int64_t chunk, auto& archive) {
                Visitor& visitor = visitor_of(chunk);
                if constexpr (std::remove_reference_t<decltype(archive)>::kUnpacks)
                    visitor = make_visitor(end_of(chunk) - begin_of(chunk));
                if constexpr (kIsShared) visitor.fields(archive);
            },
            [&](std::int64_t more) {
                // The last chunk may have fewer paths.
                const std::int64_t before = reported.fetch_add(more);
                phase.advance(static_cast<std::uint64_t>(std::min(to, begin_of(before + more)) -
                                                         std::min(to, begin_of(before))));
            });
    };
    // The sample consists of whole chunks, so that those after them begin at the same paths as without it.
    const std::int64_t sample = std::min(paths.count, std::max(traced_before, kFirstPaths));
    trace(traced_before, sample);
    if (sample > 0 && !work.monitor.stopped()) require_memory(chunks, sample, paths.count);
    trace(sample, paths.count);
}
template <typename Visitor, typename MakeVisitor>
void trace_light_paths(const LightPathWork& work, const LightPathRequest& paths, std::vector<Visitor>& chunks,
                       MakeVisitor&& make_visitor) {
    trace_light_paths(work, paths, chunks, std::forward<MakeVisitor>(make_visitor),
                      [](const std::vector<Visitor>&, std::int64_t, std::int64_t) {});
}

}  // namespace lucerna
