// Parallel loops run each chunk once, give the same result on any number of threads, and throw the error of
// the lowest chunk.
#include "engine/base/parallel.h"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "engine/base/sampler.h"

namespace lucerna {
namespace parallel_test {

// Returns a sum whose value depends on the order of its terms.
float ordered_sum(int threads, std::int64_t grain) {
    constexpr std::int64_t kTerms = 100'003;
    std::vector<float> parts(static_cast<std::size_t>((kTerms + grain - 1) / grain));
    parallel_ranges(Workers{threads}, kTerms, grain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                        float sum = 0;
                        for (std::int64_t i = begin; i < end; ++i) {
                            sum += Sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i)).next();
                        }
                        parts[static_cast<std::size_t>(chunk)] = sum;
                    });
    return std::accumulate(parts.begin(), parts.end(), 0.0F);
}

TEST(Parallel, OrderedSum_OneToEightThreads_IsTheSameBitForBit) {
    const float alone = ordered_sum(1, 1000);
    for (int threads = 2; threads <= 8; ++threads) EXPECT_EQ(ordered_sum(threads, 1000), alone) << threads;
    EXPECT_NE(ordered_sum(1, 77), alone);  // the order matters, so chunks must not depend on the threads
}

TEST(Parallel, Ranges_AnyGrain_CoverEachIndexOnce) {
    for (const std::int64_t n : {0, 1, 99, 100, 101}) {
        for (const std::int64_t grain : {1, 7, 100, 1000}) {
            std::vector<int> seen(static_cast<std::size_t>(n));
            parallel_ranges(Workers{4}, n, grain,
                            [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
                                EXPECT_EQ(begin, chunk * grain);
                                EXPECT_LE(end - begin, grain);
                                for (std::int64_t i = begin; i < end; ++i)
                                    ++seen[static_cast<std::size_t>(i)];
                            });
            EXPECT_EQ(seen, std::vector<int>(static_cast<std::size_t>(n), 1)) << n << " by " << grain;
        }
    }
}

TEST(Parallel, ManyChunksThrow_TheLowestIsRethrown) {
    for (int threads = 1; threads <= 8; ++threads) {
        for (int repeat = 0; repeat < 20; ++repeat) {
            try {
                parallel_chunks(Workers{threads}, 64, [](std::int64_t chunk) {
                    if (chunk >= 10) throw std::runtime_error(std::to_string(chunk));
                });
                ADD_FAILURE() << "no exception";
            } catch (const std::runtime_error& error) {
                EXPECT_STREQ(error.what(), "10") << threads << " threads";
            }
        }
    }
}

TEST(Parallel, HigherChunkThrowsFirst_TheLowestIsStillRun) {
    // Chunk 1 throws before chunk 0 ends; chunk 0 throws last and still wins.
    std::atomic<bool> thrown{false};
    try {
        parallel_chunks(Workers{2}, 2, [&](std::int64_t chunk) {
            if (chunk == 1) {
                thrown = true;
                throw std::runtime_error("1");
            }
            for (int i = 0; i < 1'000'000 && !thrown; ++i) std::this_thread::yield();
            throw std::runtime_error("0");
        });
        ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "0");
    }
}

TEST(Parallel, AfterAnError_LaterChunksAreSkipped) {
    std::atomic<int> done{0};
    EXPECT_THROW(parallel_chunks(Workers{2}, 100'000,
                                 [&](std::int64_t chunk) {
                                     if (chunk == 0) throw std::logic_error("");
                                     ++done;
                                 }),
                 std::logic_error);
    EXPECT_LT(done, 100'000);
}

TEST(Parallel, Counter_ManyThreads_LosesNothing) {
    const Counter counter;
    parallel_chunks(Workers{8}, 1000,
                    [&](std::int64_t chunk) { counter.add(static_cast<std::uint64_t>(chunk)); });
    EXPECT_EQ(counter.total(), 499'500U);
}

}  // namespace parallel_test
}  // namespace lucerna
