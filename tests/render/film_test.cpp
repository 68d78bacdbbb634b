#include "engine/render/film.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/base/stream.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

TEST(Film, MeanAndVarianceOfTheMean_EqualTwoPassSums) {
    Film film(2, 1);
    Stream stream(1, Purpose::test, 0, 0);
    RunningStats expected;
    for (int i = 0; i < 100; ++i) {
        const float value = 1000 + stream.next();
        expected.add(static_cast<double>(value));
        film.add(1, 0, Rgb(value));
    }
    const Image image = film.develop(2);
    EXPECT_NEAR(image.value(1, 0, 0), 2 * expected.mean(), 1e-3);
    EXPECT_NEAR(image.value(1, 0, 3), 4 * expected.variance() / 100, 0.01 * 4 * expected.variance() / 100);
    EXPECT_EQ(image.value(0, 0, 0), 0);
    EXPECT_EQ(image.value(0, 0, 3), 0);
}

// Samples of both signs: exact where nothing varies, unbiased where it does, and the variance is the one
// seen.
TEST(Film, SignedWeights_AreExactOnConstantsAndUnbiased) {
    constexpr int kPixels = 4'000, kSamples = 64;
    constexpr float kWeight = 1.5F;  // + with chance 5/6, - with 1/6: mean 1
    Film film(kPixels + 1, 1, kWeight);
    Stream stream(11, Purpose::test, 0, 0);
    for (int x = 0; x <= kPixels; ++x) {
        for (int s = 0; s < kSamples; ++s) {
            const float u = stream.next();
            const float weight = stream.next() < 5.0F / 6 ? kWeight : -kWeight;
            // Positive weights see more light: E[w L] = 5/6 · 1.5 · 3.5 - 1/6 · 1.5 · 0.5 = 4.25.
            const float radiance = x == kPixels ? 7.0F : u + (weight > 0 ? 3 : 0);
            film.add(x, 0, Rgb(radiance), weight);
        }
    }
    const Image image = film.develop(1);
    EXPECT_EQ(image.value(kPixels, 0, 0), 7);
    EXPECT_EQ(image.value(kPixels, 0, 3), 0);
    RunningStats value, variance;
    for (int x = 0; x < kPixels; ++x) {
        value.add(static_cast<double>(image.value(x, 0, 0)));
        variance.add(static_cast<double>(image.value(x, 0, 3)));
    }
    EXPECT_TRUE(testing::agrees(value, 4.25));
    EXPECT_FALSE(testing::agrees(value, 4.25 * 1.01));
    EXPECT_NEAR(variance.mean() / value.variance(), 1, 0.15);
}

class Filters : public ::testing::TestWithParam<FilterSettings::Kind> {};

// Offsets in bins against the integral of the filter over each bin.
TEST_P(Filters, Offsets_FollowTheFilter) {
    FilterSettings settings;
    settings.kind = GetParam();
    settings.radius = {1.5F, 2};
    const FilterSampler sampler(settings);
    constexpr int kBins = 30;
    constexpr int kDraws = 200'000;
    const auto filter = [&](double x) {
        const double r = 1.5;
        if (settings.kind == FilterSettings::Kind::box) return 1.0;
        if (settings.kind == FilterSettings::Kind::triangle) return r - std::fabs(x);
        return std::exp(-x * x / 0.5) - std::exp(-r * r / 0.5);
    };
    std::vector<double> expected(kBins, 0.0);
    double total = 0;
    for (int i = 0; i < kBins * 100; ++i) {
        const double x = 1.5 * (2 * (i + 0.5) / (kBins * 100) - 1);
        expected[static_cast<std::size_t>(i / 100)] += filter(x);
        total += filter(x);
    }
    for (double& e : expected) e *= kDraws / total;
    std::vector<std::uint64_t> observed(kBins, 0);
    Stream stream(3, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V2f offset = sampler.sample(stream.next2()).offset;
        ASSERT_LE(std::fabs(offset.x), 1.5F);
        ASSERT_LE(std::fabs(offset.y), 2.0F);
        const int bin = static_cast<int>((offset.x / 1.5F + 1) / 2 * kBins);
        ++observed[static_cast<std::size_t>(std::clamp(bin, 0, kBins - 1))];
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    // A filter that leans to one side by 4 % is rejected.
    for (int i = 0; i < kBins; ++i) expected[static_cast<std::size_t>(i)] *= i < kBins / 2 ? 1.04 : 0.96;
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

INSTANTIATE_TEST_SUITE_P(All, Filters,
                         ::testing::Values(FilterSettings::Kind::box, FilterSettings::Kind::triangle,
                                           FilterSettings::Kind::gaussian));

// Signed weights: the moments of what is sampled are the filter's own, negative lobes and all.
TEST(Filters, WithNegativeLobes_KeepTheirMoments) {
    for (const auto kind : {FilterSettings::Kind::mitchell, FilterSettings::Kind::sinc}) {
        FilterSettings settings;
        settings.kind = kind;
        settings.radius = {2, 3};
        const FilterSampler sampler(settings);
        RunningStats sum, second;
        Stream stream(5, Purpose::test, 0, 0);
        for (int i = 0; i < 400'000; ++i) {
            const auto [offset, weight] = sampler.sample(stream.next2());
            sum.add(static_cast<double>(weight));
            second.add(static_cast<double>(weight * offset.x * offset.x));
        }
        EXPECT_TRUE(testing::agrees(sum, 1.0));
        // ∫ x² f / ∫ f by quadrature, each filter written out once more.
        double expected = 0, total = 0;
        for (int i = 0; i < 100'000; ++i) {
            const double x = 2 * (i + 0.5) / 100'000;
            double f = 0;
            if (kind == FilterSettings::Kind::mitchell) {  // B = C = 1/3
                f = x < 1 ? (7 * x * x * x - 12 * x * x + 16.0 / 3) / 6
                          : (-7.0 / 3 * x * x * x + 12 * x * x - 20 * x + 32.0 / 3) / 6;
            } else {
                f = std::sin(M_PI * x) / (M_PI * x) * std::sin(M_PI * x / 3) / (M_PI * x / 3);
            }
            expected += x * x * f;
            total += f;
        }
        EXPECT_TRUE(testing::agrees(second, expected / total));
        EXPECT_FALSE(testing::agrees(second, expected / total + 0.02)) << "the test sees a wrong moment";
    }
    FilterSettings upside_down;
    upside_down.kind = FilterSettings::Kind::mitchell;
    upside_down.b = 0;
    upside_down.c = 200;
    EXPECT_THROW((FilterSampler(upside_down)), InputError);
}

}  // namespace
}  // namespace lucerna
