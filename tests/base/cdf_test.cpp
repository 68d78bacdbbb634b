#include "engine/base/cdf.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "engine/base/net.h"
#include "engine/base/sampler.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace cdf_test {

using testing::chi_square;

const std::vector<double> kWeights{0, 3, 0, 0.5, 1e-6, 2, 0, 4.5, 0};

std::vector<std::uint64_t> count_draws(const Cdf& cdf, int draws) {
    std::vector<std::uint64_t> counts(cdf.size());
    Sampler sampler(31, Purpose::test, 0, 0);
    for (int i = 0; i < draws; ++i) ++counts[cdf.draw(sampler.next()).item];
    return counts;
}

TEST(Cdf, Draws_AreProportionalToTheWeights) {
    constexpr int kDraws = 200'000;
    const Cdf cdf{std::span(kWeights)};
    const std::vector<std::uint64_t> counts = count_draws(cdf, kDraws);
    std::vector<double> expected;
    for (const double w : kWeights) expected.push_back(kDraws * w / 10.000001);
    EXPECT_TRUE(chi_square(counts, expected).accepted());  // also rejects any draw of a zero weight
    expected[1] *= 1.05;
    expected[7] -= 0.05 * expected[1] / 1.05;
    EXPECT_FALSE(chi_square(counts, expected).accepted());
}

TEST(Cdf, Probabilities_SumToOneAndMatchDraws) {
    const Cdf cdf{std::span(kWeights)};
    EXPECT_DOUBLE_EQ(cdf.total(), 10.000001);
    double sum = 0;
    for (std::size_t i = 0; i < cdf.size(); ++i) {
        EXPECT_NEAR(cdf.probability(i), kWeights[i] / cdf.total(), 1e-15);
        sum += cdf.probability(i);
    }
    EXPECT_NEAR(sum, 1, 1e-15);
    const auto drawn = cdf.draw(0.2F);
    EXPECT_EQ(drawn.probability, cdf.probability(drawn.item));
}

TEST(Cdf, Remainder_IsUniformWithinEveryItem) {
    const Cdf cdf{std::span(kWeights)};
    constexpr int kBins = 32;
    std::vector<std::uint64_t> counts(kBins * 2);
    std::vector<std::uint64_t> totals(2);
    Sampler sampler(32, Purpose::test, 0, 0);
    for (int i = 0; i < 200'000; ++i) {
        const auto drawn = cdf.draw(sampler.next());
        if (drawn.item != 1 && drawn.item != 7) continue;
        const std::size_t which = drawn.item == 1 ? 0 : 1;
        ++totals[which];
        ++counts[which * kBins + static_cast<std::size_t>(drawn.remainder * kBins)];
    }
    std::vector<double> expected;
    for (const std::uint64_t total : totals)
        expected.insert(expected.end(), kBins, static_cast<double>(total) / kBins);
    EXPECT_TRUE(chi_square(counts, expected).accepted());
}

TEST(Cdf, LargestAndSmallestU_DrawItemsWithWeight) {
    const Cdf cdf{std::span(kWeights)};
    EXPECT_EQ(cdf.draw(0).item, 1U);
    const auto last = cdf.draw(1 - 0x1p-24F);
    EXPECT_EQ(last.item, 7U);
    EXPECT_LT(last.remainder, 1);
    EXPECT_EQ(cdf.draw(std::nextafter(1.0F, 0.0F)).item, 7U);
    // Even 1 itself, which no sampler draws, selects an item that has weight.
    EXPECT_EQ(cdf.draw(1).item, 7U);
}

TEST(Cdf, NothingPossible_SaysSo) {
    EXPECT_EQ(Cdf().total(), 0);
    EXPECT_EQ(Cdf().size(), 0U);
    const std::vector<double> zeros(3);
    EXPECT_EQ(Cdf{std::span(zeros)}.total(), 0);
}

// Small and large tables are searched in different ways.
TEST(Cdf, ItemOfATableOfAnySize_IsThatOfALinearSearch) {
    Sampler sampler(33, Purpose::test, 0, 0);
    for (const std::size_t items : {1, 2, 63, 64, 65, 100, 1023, 1024, 2047, 2048, 2049, 5000}) {
        std::vector<double> weights(items);
        // Sums of whole numbers are exact in any order.
        for (double& weight : weights) weight = std::floor(4 * double{sampler.next()});
        weights.front() = 1;
        const Cdf cdf{std::span(weights)};
        for (int i = 0; i < 1000; ++i) {
            const float u = sampler.next();
            const double x = double{u} * cdf.total();
            std::size_t item = 0;
            for (double upto = weights[0]; upto <= x; upto += weights[++item]) {
            }
            ASSERT_EQ(cdf.draw(u).item, item) << items << " items, u = " << u;
        }
    }
}

RC_GTEST_PROP(CdfProperties, AnyWeights_DrawsAnItemOfWeight,
              (const std::vector<std::uint16_t>& raw, std::uint32_t bits)) {
    std::vector<double> weights;
    for (const std::uint16_t r : raw) weights.push_back(r % 3 == 0 ? 0.0 : std::ldexp(r, r % 64 - 32));
    const Cdf cdf{std::span(weights)};
    RC_PRE(cdf.total() > 0);
    for (const float u : {to_unit(bits), 0.0F, 1 - 0x1p-24F}) {
        const auto drawn = cdf.draw(u);
        RC_ASSERT(weights[drawn.item] > 0);
        RC_ASSERT(drawn.probability > 0);
        RC_ASSERT(drawn.remainder >= 0 && drawn.remainder < 1);
    }
}

}  // namespace cdf_test
}  // namespace lucerna
