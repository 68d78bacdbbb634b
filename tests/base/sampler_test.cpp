// Random numbers are a pure function of their key, and uniform in every projection.
#include "engine/base/sampler.h"

#include <gtest/gtest.h>

#include <array>
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

Sampler path(std::uint64_t i) {
    return {1, Purpose::test, 0, i};
}

std::vector<float> first_numbers(Sampler sampler) {
    std::vector<float> numbers;
    for (int i = 0; i < 8; ++i) {
        numbers.push_back(sampler.next());
        const V2f p = sampler.next2();
        numbers.push_back(p.x);
        numbers.push_back(p.y);
        numbers.push_back(to_unit(sampler.bits()));
    }
    return numbers;
}

// Four samples for each of eight paths of a family place one number in each thirty-second of the interval.
TEST(SplitAlike, SamplesOfABranch_AreStratifiedOverAllPathsOfTheFamily) {
    constexpr std::uint32_t kPaths = 8, kEach = 4;
    std::array<std::set<int>, 3> strata;
    for (std::uint32_t p = 0; p < kPaths; ++p) {
        const Sampler path = Sampler::stratified(7, Purpose::test, 3, p);
        for (std::uint32_t i = 0; i < kEach; ++i) {
            Sampler sampler = path.split_alike(9, i, kEach);
            const float u = sampler.next();
            const V2f v = sampler.next2();
            strata[0].insert(static_cast<int>(u * kPaths * kEach));
            strata[1].insert(static_cast<int>(v.x * kPaths * kEach));
            strata[2].insert(static_cast<int>(v.y * kPaths * kEach));
        }
    }
    for (const auto& hit : strata) EXPECT_EQ(hit.size(), kPaths * kEach);
    // Branches with independent numbers are not stratified.
    std::set<int> apart;
    for (std::uint32_t p = 0; p < kPaths; ++p) {
        for (std::uint32_t i = 0; i < kEach; ++i) {
            Sampler sampler = Sampler::stratified(7, Purpose::test, 3, p).split_alike(9 + i);
            apart.insert(static_cast<int>(sampler.next() * kPaths * kEach));
        }
    }
    EXPECT_LT(apart.size(), kPaths * kEach);
}

TEST(SamplerFamily, Paths_DrawWhatStratifiedSamplersDraw) {
    const SamplerFamily family(7, Purpose::test, 3);
    for (const std::uint32_t index : {0U, 1U, 77U, 0xffffffffU}) {
        Sampler known = family.path(index), plain = Sampler::stratified(7, Purpose::test, 3, index);
        for (int i = 0; i < 60; ++i) {  // beyond the draws that the family stores
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

TEST(SamplerUniform, OneSampler_IsUniform) {
    Sampler sampler = path(0);
    EXPECT_TRUE(uniform_1d([&](std::uint64_t) { return sampler.next(); }).accepted());
    EXPECT_TRUE(uniform_2d([&](std::uint64_t) { return sampler.next2(); }).accepted());
    EXPECT_TRUE(uniform_1d([&](std::uint64_t) { return to_unit(sampler.bits()); }).accepted());
}

TEST(SamplerUniform, FirstDrawsOfConsecutivePaths_AreUniform) {
    EXPECT_TRUE(uniform_1d([](std::uint64_t i) { return path(i).next(); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) { return path(i).next2(); }).accepted());
}

TEST(SamplerUniform, PairsAcrossDrawsPathsPassesAndSeeds_AreUniform) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    Sampler sampler = path(i);
                    const float first = sampler.next();
                    return V2f(first, sampler.next());
                }).accepted());
    EXPECT_TRUE(
        uniform_2d([](std::uint64_t i) { return V2f(path(i).next(), path(i + 1).next()); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto pass = static_cast<std::uint32_t>(i);
                    return V2f(Sampler(1, Purpose::test, pass, 7).next(),
                               Sampler(1, Purpose::test, pass + 1, 7).next());
                }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    return V2f(Sampler(i, Purpose::test, 0, 0).next(),
                               Sampler(i + 1, Purpose::test, 0, 0).next());
                }).accepted());
}

TEST(SamplerUniform, PairsAcrossPurposesAndBranches_AreUniform) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    return V2f(Sampler(1, Purpose::camera, 0, i).next(),
                               Sampler(1, Purpose::emission, 0, i).next());
                }).accepted());
    EXPECT_TRUE(
        uniform_2d([](std::uint64_t i) { return V2f(path(i).next(), path(i).split(0).next()); }).accepted());
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto branch = static_cast<std::uint32_t>(i);
                    return V2f(path(3).split(branch).next(), path(3).split(branch + 1).next());
                }).accepted());
}

TEST(SamplerUniform, StratifiedDrawsAgainstEachOther_AreIndependent) {
    // Nets are more even than random numbers; different draws and different families must look random
    // together.
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  Sampler sampler = Sampler::stratified(2, Purpose::test, i, 0);
                  const float first = sampler.next();
                  return V2f(first, sampler.next());
              }).p_value,
              testing::kFalseAlarm);
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  return V2f(Sampler::stratified(2, Purpose::test, i, 5).next2().x,
                             Sampler::stratified(2, Purpose::test, i + 1, 5).next2().x);
              }).p_value,
              testing::kFalseAlarm);
    EXPECT_GT(uniform_2d([](std::uint64_t i) {
                  Sampler sampler =
                      Sampler::stratified(2, Purpose::test, i >> 4, static_cast<std::uint32_t>(i & 15U));
                  const float first = sampler.next2().y;
                  return V2f(first, sampler.next2().y);
              }).p_value,
              testing::kFalseAlarm);
}

TEST(SamplerUniform, BadGenerators_AreRejected) {
    // The test must reject a linear congruential generator whose consecutive values lie on few lines, and a
    // slightly uneven one.
    std::uint32_t state = 1;
    const auto bad = [&] {
        state = (state * 65 + 1) & 0xffffU;
        return static_cast<float>(state) / 65536;
    };
    EXPECT_FALSE(uniform_2d([&](std::uint64_t) {
                     const float first = bad();
                     return V2f(first, bad());
                 }).accepted());
    Sampler sampler = path(0);
    EXPECT_FALSE(uniform_1d([&](std::uint64_t) { return std::pow(sampler.next(), 1.02F); }).accepted());
    // The test must reject consecutive paths seeded by their number without a hash.
    EXPECT_FALSE(uniform_2d([&](std::uint64_t i) {
                     return V2f(to_unit(static_cast<std::uint32_t>(i * 2654435769U)),
                                to_unit(static_cast<std::uint32_t>((i + 1) * 2654435769U)));
                 }).accepted());
}

TEST(SamplerKeys, EveryPartOfTheKey_MakesAnotherSampler) {
    std::set<std::vector<float>> samplers;
    std::size_t made = 0;
    const auto add = [&](const Sampler& sampler) {
        samplers.insert(first_numbers(sampler));
        ++made;
    };
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        for (std::uint32_t purpose = 0; purpose <= static_cast<std::uint32_t>(Purpose::tile); ++purpose) {
            for (std::uint32_t pass = 0; pass < 3; ++pass) {
                for (const std::uint64_t p : {0ULL, 1ULL, 1ULL << 32, ~0ULL}) {
                    const Sampler sampler(seed, static_cast<Purpose>(purpose), pass, p);
                    add(sampler);
                    add(sampler.split(0));
                    add(sampler.split(1));
                    add(sampler.split(0).split(0));
                    add(sampler.split_stratified(0, 0));
                    add(sampler.split_stratified(0, 1));
                }
            }
            for (std::uint64_t family = 0; family < 3; ++family) {
                for (std::uint32_t index = 0; index < 3; ++index) {
                    const Sampler sampler =
                        Sampler::stratified(seed, static_cast<Purpose>(purpose), family, index);
                    add(sampler);
                    add(sampler.split(0));
                }
            }
        }
    }
    EXPECT_EQ(samplers.size(), made);
}

TEST(SamplerKeys, StratifiedBranches_OfDifferentIndices_AreIndependent) {
    EXPECT_TRUE(uniform_2d([](std::uint64_t i) {
                    const auto index = static_cast<std::uint32_t>(i);
                    return V2f(Sampler::stratified(2, Purpose::test, 0, index).split(0).next(),
                               Sampler::stratified(2, Purpose::test, 0, index + 1).split(0).next());
                }).accepted());
}

TEST(SamplerKeys, SplitAfterDraws_DependsOnThePosition) {
    Sampler sampler = path(5);
    const float early = sampler.split(0).next();
    sampler.next();
    EXPECT_NE(sampler.split(0).next(), early);
    EXPECT_EQ(path(5).split(0).next(), early);
}

TEST(SamplerThreads, AnyOrderAndNumberOfThreads_GivesTheSameNumbers) {
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
