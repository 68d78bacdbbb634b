#include "engine/base/stats.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <vector>

#include "engine/base/sampler.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace stats_test {

TEST(RunningStats, LargeOffset_EqualsTwoPasses) {
    for (const double offset : {0.0, 1e6, 1e12}) {
        std::vector<double> values;
        Sampler sampler(41, Purpose::test, 0, 0);
        for (int i = 0; i < 10'000; ++i) values.push_back(offset + static_cast<double>(sampler.next()));
        RunningStats stats;
        for (const double x : values) stats.add(x);
        // Computes the expected value in two passes, in long double.
        long double sum = 0;
        for (const double x : values) sum += static_cast<long double>(x);
        const long double mean = sum / static_cast<long double>(values.size());
        long double squares = 0;
        for (const double x : values)
            squares += (static_cast<long double>(x) - mean) * (static_cast<long double>(x) - mean);
        const auto variance = static_cast<double>(squares / static_cast<long double>(values.size() - 1));
        EXPECT_EQ(stats.count(), values.size());
        EXPECT_NEAR(stats.mean(), static_cast<double>(mean), 1e-14 * offset + 1e-12);
        // At 1e12 the spacing of doubles is 1e-4, which is the rounding of the values themselves.
        EXPECT_NEAR(stats.variance(), variance, offset > 1e9 ? 1e-3 * variance : 1e-8 * variance);
        EXPECT_NEAR(stats.standard_error(), std::sqrt(variance / 10'000), 1e-5);
    }
}

TEST(RunningStats, TextbookFormula_WouldFailTheTestAbove) {
    // The formula mean(x²) - mean(x)² loses all digits of a variance of 1/12 at an offset of 1e9.
    double sum = 0;
    double squares = 0;
    Sampler sampler(41, Purpose::test, 0, 0);
    constexpr int kValues = 10'000;
    for (int i = 0; i < kValues; ++i) {
        const double x = 1e9 + static_cast<double>(sampler.next());
        sum += x;
        squares += x * x;
    }
    const double variance = squares / kValues - sqr(sum / kValues);
    EXPECT_GT(std::fabs(variance - 1.0 / 12), 1e-3);
}

RC_GTEST_PROP(WeightedQuantile, OfAnyValues_IsThatOfSortedOnes, ()) {
    std::vector<Weighed> values;
    for (const auto& [value, weight] :
         *rc::gen::nonEmpty<std::vector<std::pair<std::int8_t, std::uint8_t>>>())
        values.push_back({static_cast<double>(value) / 4, static_cast<double>(weight)});  // sums are exact
    const double share = *rc::gen::inRange(0, 65) / 64.0;
    std::vector<Weighed> sorted = values;
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const Weighed& a, const Weighed& b) { return a.value < b.value; });
    double total = 0, sum = 0, expected = sorted.back().value;
    for (const Weighed& v : values) total += v.weight;
    for (const Weighed& v : sorted) {
        sum += v.weight;
        if (sum < share * total) continue;
        expected = v.value;
        break;
    }
    RC_ASSERT(weighted_quantile(values, share) == expected);
}

TEST(RunningStats, FewValues_AreDefined) {
    RunningStats stats;
    EXPECT_EQ(stats.variance(), 0);
    EXPECT_EQ(stats.standard_error(), 0);
    stats.add(5);
    EXPECT_EQ(stats.mean(), 5);
    EXPECT_EQ(stats.variance(), 0);
    stats.add(7);
    EXPECT_EQ(stats.mean(), 6);
    EXPECT_EQ(stats.variance(), 2);
}

TEST(RunningStats, NaN_IsNotSwallowed) {
    RunningStats stats;
    stats.add(1);
    stats.add(NAN);
    stats.add(1);
    EXPECT_TRUE(std::isnan(stats.mean()));
}

// All other tests rely on the statistical helpers: these must accept correct samples and reject wrong ones.
TEST(TestStatistics, ChiSquareAndAgrees_RightAndWrong_AreToldApart) {
    std::vector<std::uint64_t> counts(10);
    RunningStats stats;
    Sampler sampler(42, Purpose::test, 0, 0);
    for (int i = 0; i < 100'000; ++i) {
        const float u = sampler.next();
        ++counts[static_cast<std::size_t>(u * 10)];
        stats.add(static_cast<double>(u));
    }
    EXPECT_TRUE(testing::chi_square(counts, std::vector<double>(10, 10'000)).accepted());
    std::vector<double> wrong(10, 10'000);
    wrong[0] += 500;
    wrong[1] -= 500;
    EXPECT_FALSE(testing::chi_square(counts, wrong).accepted());
    wrong.assign(10, 100'000.0 / 9);
    wrong[9] = 0;
    EXPECT_FALSE(testing::chi_square(counts, wrong).accepted());
    EXPECT_TRUE(testing::agrees(stats, 0.5));
    EXPECT_FALSE(testing::agrees(stats, 0.505));
}

}  // namespace stats_test
}  // namespace lucerna
