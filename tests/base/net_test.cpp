// The (0,2)-sequence: every elementary interval holds exactly one of any 2^k consecutive points.
#include "engine/base/net.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "engine/base/sampler.h"

namespace lucerna {
namespace net_test {

// Returns the shape 2^-a × 2^-(k-a) of an elementary interval that does not contain exactly one of the 2^k
// points, or -1.
int broken_shape(int k, const std::function<V2f(std::uint32_t)>& point) {
    const std::uint32_t n = 1U << k;
    for (int a = 0; a <= k; ++a) {
        std::vector<int> seen(n);
        for (std::uint32_t i = 0; i < n; ++i) {
            const V2f p = point(i);
            const auto column = static_cast<std::uint32_t>(p.x * static_cast<float>(1U << a));
            const auto row = static_cast<std::uint32_t>(p.y * static_cast<float>(1U << (k - a)));
            if (seen[(column << (k - a)) + row]++ != 0) return a;
        }
    }
    return -1;
}

// Computes the second dimension by its generator matrix, one column for every bit of the index.
std::uint32_t sobol_1_by_columns(std::uint32_t index) {
    std::uint32_t result = 0;
    for (std::uint32_t column = 1U << 31; index != 0; index >>= 1, column ^= column >> 1) {
        if ((index & 1U) != 0) result ^= column;
    }
    return result;
}

RC_GTEST_PROP(NetProperties, SobolsSecondDimension_BySupersets_IsThatOfItsColumns, (std::uint32_t index)) {
    RC_ASSERT(sobol_1(index) == sobol_1_by_columns(index));
}

TEST(Net, Sobol_ConsecutivePoints_AreANet) {
    for (int k = 0; k <= 10; ++k) {
        for (const std::uint32_t block : {0U, 1U, 5U, 1000U}) {
            const std::uint32_t first = block << k;
            EXPECT_EQ(broken_shape(k,
                                   [&](std::uint32_t i) {
                                       return V2f(to_unit(reverse_bits(first + i)),
                                                  to_unit(sobol_1(first + i)));
                                   }),
                      -1);
        }
    }
}

TEST(Net, OwenScrambled_ConsecutivePoints_AreANet) {
    for (const std::uint32_t seed : {0U, 1U, 0xdeadbeefU, 0xffffffffU}) {
        EXPECT_EQ(broken_shape(8,
                               [&](std::uint32_t i) {
                                   return V2f(to_unit(owen_scramble(reverse_bits(i), seed)),
                                              to_unit(owen_scramble(sobol_1(i), ~seed)));
                               }),
                  -1);
    }
}

TEST(Net, StratifiedSampler_EveryDraw_IsANet) {
    for (std::uint64_t family = 0; family < 8; ++family) {
        for (int draw = 0; draw < 5; ++draw) {
            for (const std::uint32_t first : {0U, 256U, 4096U}) {
                EXPECT_EQ(broken_shape(8,
                                       [&](std::uint32_t i) {
                                           Sampler sampler =
                                               Sampler::stratified(3, Purpose::test, family, first + i);
                                           for (int skip = 0; skip < draw; ++skip) sampler.next2();
                                           return sampler.next2();
                                       }),
                          -1)
                    << "family " << family << ", draw " << draw;
            }
        }
    }
}

TEST(Net, StratifiedSampler_OneDimension_HasOnePointPerStratum) {
    std::vector<int> seen(1024);
    for (std::uint32_t i = 0; i < 1024; ++i) {
        Sampler sampler = Sampler::stratified(3, Purpose::test, 1, i);
        sampler.next2();
        ++seen[static_cast<std::size_t>(sampler.next() * 1024)];
    }
    for (const int count : seen) EXPECT_EQ(count, 1);
}

TEST(Net, SplitStratified_SamplesOfOneBranch_AreANet) {
    const Sampler parent(4, Purpose::test, 0, 17);
    EXPECT_EQ(broken_shape(6, [&](std::uint32_t i) { return parent.split_stratified(2, i).next2(); }), -1);
}

TEST(Net, IndependentPoints_AreNoNet) {
    EXPECT_NE(broken_shape(8, [](std::uint32_t i) { return Sampler(5, Purpose::test, 0, i).next2(); }), -1);
}

RC_GTEST_PROP(NetProperties, OwenScramble_AnySeed_KeepsPrefixesTogether,
              (std::uint32_t a, std::uint32_t seed)) {
    // Owen scrambling is nested: words with a common prefix keep one of the same length, and then differ.
    const std::uint32_t x = owen_scramble(a, seed);
    for (int bit = 0; bit < 32; ++bit) {
        const std::uint32_t y = owen_scramble(a ^ (1U << bit), seed);
        RC_ASSERT(((x ^ y) >> bit) == 1U);
    }
}

RC_GTEST_PROP(NetProperties, ReverseBits_Twice_IsNothing, (std::uint32_t a)) {
    RC_ASSERT(reverse_bits(reverse_bits(a)) == a);
    RC_ASSERT((reverse_bits(a) >> 31) == (a & 1U));
}

RC_GTEST_PROP(NetProperties, ToUnit_IsTheWordRoundedDown, (std::uint32_t a)) {
    const std::uint32_t x = a >> (a % 32);
    const double exact = x * 0x1p-32, found = double{to_unit(x)};
    RC_ASSERT(found <= exact);
    RC_ASSERT(exact - found < std::max(0x1p-31, exact * 0x1p-23));
    RC_ASSERT(to_unit_each(Words4{x, 0, x, a})[2] == to_unit(x));
    RC_ASSERT(to_unit_each(Words8{0, 0, 0, 0, 0, 0, x, a})[6] == to_unit(x));
}

TEST(Net, ToUnit_Largest_IsBelowOne) {
    EXPECT_EQ(to_unit(0), 0);
    EXPECT_LT(to_unit(0xffffffffU), 1);
    EXPECT_EQ(to_unit(0x80000000U), 0.5F);
}

}  // namespace net_test
}  // namespace lucerna
