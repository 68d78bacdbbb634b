// Only this file uses OpenMP.
//
// Work is divided into chunks whose size does not depend on the number of threads. A chunk's result goes to
// the slot of its number, and slots are joined in order. Every result is therefore the same, bit for bit, on
// any number of threads.
#pragma once

#include <omp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <utility>

#include "engine/base/float_traps.h"

// ThreadSanitizer does not see OpenMP's synchronisation, so it is told what a loop's start and end order.
#if defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define LUCERNA_SEES_RACES
#include <sanitizer/tsan_interface.h>
#endif
#endif

namespace lucerna {

// Everything before signal() in one thread happens before everything after wait() in another.
class Ordered {
  public:
    void signal() {
#ifdef LUCERNA_SEES_RACES
        __tsan_release(this);
#endif
    }
    void wait() {
#ifdef LUCERNA_SEES_RACES
        __tsan_acquire(this);
#endif
    }
};

class Ranks;

// Holds the number of threads, and the ranks of a parallel job (engine/ranks/ranks.h) that share the work;
// null means this process alone. It is passed as a value and never a global setting. A function that takes
// workers with ranks may be collective: all ranks must call it, in the same order.
struct Workers {
    int threads = std::max(1, omp_get_num_procs());
    Ranks* ranks = nullptr;

    // Returns workers for what one rank does alone, or every rank for itself.
    Workers alone() const { return {threads}; }
};

// Calls body(chunk) once for every chunk in [0, chunks), in any order. If any call throws, the exception of
// the lowest such chunk is rethrown once all threads are done: all chunks below it are run, and those above
// it are skipped unless they have begun. The error, too, is therefore the same on any number of threads.
template <typename Body>
void parallel_chunks(const Workers& workers, std::int64_t chunks, Body&& body) {
    std::atomic<std::int64_t> error_chunk{chunks};
    std::exception_ptr error;
    std::mutex error_mutex;
    Ordered begin, end;
    const int traps = FloatTraps::armed();
    begin.signal();
    // There are no more threads than chunks: a single chunk must not wait for idle threads to wake up.
    const int threads =
        static_cast<int>(std::max<std::int64_t>(1, std::min<std::int64_t>(chunks, workers.threads)));
#pragma omp parallel num_threads(threads)
    {
        begin.wait();
        const FloatTraps callers(traps);
#pragma omp for schedule(dynamic, 1) nowait
        for (std::int64_t chunk = 0; chunk < chunks; ++chunk) {
            if (chunk > error_chunk.load(std::memory_order_relaxed)) continue;
            try {
                body(chunk);
            } catch (...) {
                const std::lock_guard lock(error_mutex);
                if (chunk < error_chunk.load(std::memory_order_relaxed)) {
                    error_chunk.store(chunk, std::memory_order_relaxed);
                    error = std::current_exception();
                }
            }
        }
        end.signal();
    }
    end.wait();
    if (error) std::rethrow_exception(error);
}

// Splits [0, n) into ranges of `grain` and calls body(begin, end, chunk).
template <typename Body>
void parallel_ranges(const Workers& workers, std::int64_t n, std::int64_t grain, Body&& body) {
    parallel_chunks(workers, (n + grain - 1) / grain, [&](std::int64_t chunk) {
        body(chunk * grain, std::min(n, (chunk + 1) * grain), chunk);
    });
}

// Calls body(i) for every i in [0, n), in ranges of `grain`.
template <typename Body>
void parallel_each(const Workers& workers, std::size_t n, std::int64_t grain, Body&& body) {
    parallel_ranges(workers, static_cast<std::int64_t>(n), grain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t /*chunk*/) {
                        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
                            body(i);
                    });
}

// Counts events of many threads without contention, for statistics only.
class Counter {
  public:
    void add(std::uint64_t n = 1) const {
        lanes_[static_cast<std::size_t>(omp_get_thread_num()) % lanes_.size()].value.fetch_add(
            n, std::memory_order_relaxed);
    }
    std::uint64_t total() const {
        std::uint64_t sum = 0;
        for (const Lane& lane : lanes_) sum += lane.value.load(std::memory_order_relaxed);
        return sum;
    }

  private:
    struct alignas(64) Lane {
        std::atomic<std::uint64_t> value{0};
    };
    mutable std::array<Lane, 32> lanes_{};
};

}  // namespace lucerna
