// Random numbers: a pure function of their key, and uniform whichever way they are looked at.
#include "engine/base/stream.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <vector>

#include "engine/base/parallel.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace stream_test {

using testing::chi_square;
using testing::ChiSquare;

constexpr std::uint64_t kDraws = 1U << 18;

ChiSquare uniform(const std::vector<std::uint64_t>& counts) {
    const std::vector<double> expected(counts.size(),
                                       static_cast<double>(kDraws) / static_cast<double>(counts.size()));
    return chi_square(counts, expected);
}

ChiSquare uniform_1d(const std::function<float(std::uint64_t)>& number) {
    std::vector<std::uint64_t> counts(256);
    for (std::uint64_t i = 0; i < kDraws; ++i) ++counts[static_cast<std::size_t>(number(i) * 256)];
    return uniform(counts);
}

ChiSquare uniform_2d(const std::function<V2f(std::uint64_t)>& point) {
    std::vector<std::uint64_t> counts(32 * 32);
    for (std::uint64_t i = 0; i < kDraws; ++i) {
        const V2f p = point(i);
        ++counts[static_cast<std::size_t>(p.x * 32) * 32 + static_cast<std::size_t>(p.y * 32)];
    }
    return uniform(counts);
}

Stream path(std::uint64_t i) {
    return {1, Purpose::test, 0, i};
}

std::vector<float> first_numbers(Stream stream) {
    std::vector<float> numbers;
    for (int i = 0; i < 8; ++i) {
        numbers.push_back(stream.next());
        const V2f p = stream.next2();
        numbers.push_back(p.x);
        numbers.push_back(p.y);
        numbers.push_back(to_unit(stream.bits()));
    }
    return numbers;
}

TEST(StreamFamily, Paths_DrawWhatStratifiedStreamsDraw) {
    const StreamFamily family(7, Purpose::test, 3);
    for (const std::uint32_t index : {0U, 1U, 77U, 0xffffffffU}) {
        Stream known = family.path(index), plain = Stream::stratified(7, Purpose::test, 3, index);
        for (int i = 0; i < 60; ++i) {  // beyond the draws that the family keeps
            ASSERT_EQ(known.next(), plain.next()) << i;
            ASSERT_EQ(known.next2(), plain.next2()) << i;
            if (i % 10 == 0) {
                ASSERT_EQ(known.bits(), plain.bits());
                ASSERT_EQ(known.split(5).next(), plain.split(5).next());
                ASSERT_EQ(known.split_stratified(5, 2).next2(), plain.split_stratified(5, 2).next2());
            }
        }
    }
}

TEST(StreamUniform, OneStream_IsUniform) {
    Stream stream = path(0);
    EXPECT_TRUE(uniform_1d([&](std::uint64_t) { return stream.next(); }).accepted());
    EXPECT_TRUE(uniform_2d([&](std::uint64_t) { return stream.next2(); }).accepted());
    EXPECT_TRUE(uniform_1d([&](std::uint64_t) { return to_unit(stream.bits()); }).accepted());
}

TEST(StreamUniform, FirstDrawsOfConsecutivePaths_AreUniform) {
    EXPECT_TRUE(uniform_1d([](std::uint64_t i) { return path(i).next(); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) { return path(i).next2(); }).accepted());
}

TEST(StreamUniform, PairsAcrossDrawsPathsPassesAndSeeds_AreUniform) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    Stream stream = path(i);
                    const float first = stream.next();
                    return V2f(first, stream.next());
                }).accepted());
    EXPECT_TRUE(
        uniform_2d([](std::uint64_t i) { return V2f(path(i).next(), path(i + 1).next()); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto pass = static_cast<std::uint32_t>(i);
                    return V2f(Stream(1, Purpose::test, pass, 7).next(),
                               Stream(1, Purpose::test, pass + 1, 7).next());
                }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    return V2f(Stream(i, Purpose::test, 0, 0).next(),
                               Stream(i + 1, Purpose::test, 0, 0).next());
                }).accepted());
}

TEST(StreamUniform, PairsAcrossPurposesAndBranches_AreUniform) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    return V2f(Stream(1, Purpose::camera, 0, i).next(),
                               Stream(1, Purpose::emission, 0, i).next());
                }).accepted());
    EXPECT_TRUE(
        uniform_2d([](std::uint64_t i) { return V2f(path(i).next(), path(i).split(0).next()); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto branch = static_cast<std::uint32_t>(i);
                    return V2f(path(3).split(branch).next(), path(3).split(branch + 1).next());
                }).accepted());
}

TEST(StreamUniform, StratifiedDrawsAgainstEachOther_AreIndependent) {
    // Nets are too even in themselves; what must look random is one draw beside another, and family beside
    // family.
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  Stream stream = Stream::stratified(2, Purpose::test, i, 0);
                  const float first = stream.next();
                  return V2f(first, stream.next());
              }).p_value,
              testing::kFalseAlarm);
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  return V2f(Stream::stratified(2, Purpose::test, i, 5).next2().x,
                             Stream::stratified(2, Purpose::test, i + 1, 5).next2().x);
              }).p_value,
              testing::kFalseAlarm);
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  Stream stream =
                      Stream::stratified(2, Purpose::test, i >> 4, static_cast<std::uint32_t>(i & 15U));
                  const float first = stream.next2().y;
                  return V2f(first, stream.next2().y);
              }).p_value,
              testing::kFalseAlarm);
}

TEST(StreamUniform, BadGenerators_AreRejected) {
    // A linear congruential generator whose consecutive values lie on few lines, and one that is a little
    // uneven.
    std::uint32_t state = 1;
    const auto bad = [&] {
        state = (state * 65 + 1) & 0xffffU;
        return static_cast<float>(state) / 65536;
    };
    EXPECT_FALSE(uniform_2d([&](std::uint64_t) {
                     const float first = bad();
                     return V2f(first, bad());
                 }).accepted());
    Stream stream = path(0);
    EXPECT_FALSE(uniform_1d([&](std::uint64_t) { return std::pow(stream.next(), 1.02F); }).accepted());
    // Consecutive paths seeded by their number, without a hash.
    EXPECT_FALSE(uniform_2d([&](std::uint64_t i) {
                     return V2f(to_unit(static_cast<std::uint32_t>(i * 2654435769U)),
                                to_unit(static_cast<std::uint32_t>((i + 1) * 2654435769U)));
                 }).accepted());
}

TEST(StreamKeys, EveryPartOfTheKey_MakesAnotherStream) {
    std::set<std::vector<float>> streams;
    std::size_t made = 0;
    const auto add = [&](const Stream& stream) {
        streams.insert(first_numbers(stream));
        ++made;
    };
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        for (std::uint32_t purpose = 0; purpose <= static_cast<std::uint32_t>(Purpose::tile); ++purpose) {
            for (std::uint32_t pass = 0; pass < 3; ++pass) {
                for (const std::uint64_t p : {0ULL, 1ULL, 1ULL << 32, ~0ULL}) {
                    const Stream stream(seed, static_cast<Purpose>(purpose), pass, p);
                    add(stream);
                    add(stream.split(0));
                    add(stream.split(1));
                    add(stream.split(0).split(0));
                    add(stream.split_stratified(0, 0));
                    add(stream.split_stratified(0, 1));
                }
            }
            for (std::uint64_t family = 0; family < 3; ++family) {
                for (std::uint32_t index = 0; index < 3; ++index) {
                    const Stream stream =
                        Stream::stratified(seed, static_cast<Purpose>(purpose), family, index);
                    add(stream);
                    add(stream.split(0));
                }
            }
        }
    }
    EXPECT_EQ(streams.size(), made);
}

TEST(StreamKeys, StratifiedBranches_OfDifferentIndices_AreIndependent) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto index = static_cast<std::uint32_t>(i);
                    return V2f(Stream::stratified(2, Purpose::test, 0, index).split(0).next(),
                               Stream::stratified(2, Purpose::test, 0, index + 1).split(0).next());
                }).accepted());
}

TEST(StreamKeys, SplitAfterDraws_DependsOnThePosition) {
    Stream stream = path(5);
    const float early = stream.split(0).next();
    stream.next();
    EXPECT_NE(stream.split(0).next(), early);
    EXPECT_EQ(path(5).split(0).next(), early);
}

TEST(StreamThreads, AnyOrderAndNumberOfThreads_GivesTheSameNumbers) {
    constexpr std::int64_t kPaths = 1000;
    std::vector<std::vector<float>> serial;
    for (std::int64_t i = 0; i < kPaths; ++i)
        serial.push_back(first_numbers(path(static_cast<std::uint64_t>(i))));
    for (const int threads : {1, 2, 5, 8}) {
        std::vector<std::vector<float>> parallel(kPaths);
        parallel_chunks(Workers{threads}, kPaths, [&](std::int64_t i) {
            const std::int64_t backwards = kPaths - 1 - i;
            parallel[static_cast<std::size_t>(backwards)] =
                first_numbers(path(static_cast<std::uint64_t>(backwards)));
        });
        EXPECT_EQ(parallel, serial) << threads;
    }
}

}  // namespace stream_test
}  // namespace lucerna
