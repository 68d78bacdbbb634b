#include "lights/measurement/exposure.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/sampler.h"
#include "lights/measurement/camera_simulation.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace exposure_test {

using ::testing::ElementsAre;

std::vector<float> noise(const V2i& size, std::uint64_t seed) {
    std::vector<float> image(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
    Sampler sampler(seed, Purpose::test, 0, 0);
    for (float& x : image) x = sampler.next();
    return image;
}

// Sorts each window, independently of the implementation.
float brute_median(const std::vector<float>& image, const V2i& size, int x, int y) {
    std::vector<float> window;
    for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
            if (x + i < 0 || y + j < 0 || x + i >= size.x || y + j >= size.y) continue;
            window.push_back(image[static_cast<std::size_t>((y + j) * size.x + x + i)]);
        }
    }
    std::sort(window.begin(), window.end());
    const std::size_t half = window.size() / 2;
    return window.size() % 2 == 1 ? window[half] : 0.5F * (window[half - 1] + window[half]);
}

TEST(Median, AnyImage_EqualsSortedWindows) {
    for (const V2i& size : {V2i(1, 1), V2i(2, 1), V2i(3, 7), V2i(16, 9), V2i(1, 12)}) {
        const std::vector<float> image = noise(size, 3);
        const std::vector<float> medians = median_5x5(image, size, {2});
        for (int y = 0; y < size.y; ++y) {
            for (int x = 0; x < size.x; ++x) {
                EXPECT_EQ(medians[static_cast<std::size_t>(y * size.x + x)], brute_median(image, size, x, y))
                    << size.x << " " << x << " " << y;
            }
        }
    }
}

TEST(DarkFrame, HotPixelsOnASlope_AreFound_AndTheSlopeStays) {
    const V2i size(40, 30);
    std::vector<std::vector<float>> frames;
    for (std::uint64_t f = 0; f < 4; ++f) {
        frames.push_back(noise(size, 10 + f));
        for (std::size_t i = 0; i < frames.back().size(); ++i)
            frames.back()[i] += 100 + 0.05F * static_cast<float>(i % 40);
        for (const std::size_t hot : {45U, 46U, 700U, 1199U}) frames.back()[hot] += 20;
    }
    const DarkFrame dark = dark_frame(frames, size, {1, 0, 0}, 90, {2});
    EXPECT_THAT(dark.hot, ElementsAre(45U, 46U, 700U, 1199U));
    for (std::size_t i = 0; i < dark.level.size(); ++i) {
        const double slope = 100.5 + 0.05 * static_cast<double>(i % 40);
        const bool hot = std::binary_search(dark.hot.begin(), dark.hot.end(), static_cast<std::uint32_t>(i));
        EXPECT_NEAR(dark.level[i], slope + (hot ? 20 : 0), 0.5) << i;
        // Uniform noise has variance 1/12 and there are four frames; the median of 25 has about (π/2) / 25 of
        // that variance. A hot pixel's level has a quarter of its shot noise.
        EXPECT_NEAR(dark.variance[i], hot ? (slope + 20 - 90) / 4 : 1.0 / 12 / 4 * 1.57 / 25,
                    hot ? 0.5 : 0.3e-3);
    }
}

TEST(DarkFrame, OfOneValue_HasNoHotPixels) {
    const DarkFrame dark =
        dark_frame(std::vector<std::vector<float>>(1, std::vector<float>(64, 7)), {8, 8}, {}, 0, {1});
    EXPECT_TRUE(dark.hot.empty());
    EXPECT_EQ(dark.level, std::vector<float>(64, 7));
}

TEST(Mend, BlindPixels_BecomeTheMedianOfTheOthers) {
    std::vector<float> image(64);
    for (std::size_t i = 0; i < 64; ++i) image[i] = static_cast<float>(i % 8);  // a slope along x
    image[27] = image[28] = 1000;
    const std::vector<std::uint32_t> blind{27, 28};
    mend(image, {8, 8}, blind);
    EXPECT_EQ(image[27], 3);
    EXPECT_EQ(image[28], 4);
}

// Merges a series of exposures of one pixel.
MergedExposures merged(const std::vector<double>& seconds, const std::vector<float>& counts, float dark,
                       const CountNoise& noise) {
    static constexpr float kNone = 0;
    std::vector<Exposure> exposures;
    for (std::size_t e = 0; e < seconds.size(); ++e)
        exposures.push_back({seconds[e], {&counts[e], 1}, {&dark, 1}, {&kNone, 1}, double{dark}});
    return merge_exposures(exposures, noise);
}

TEST(Merge, ShotNoiseAlone_IsTheSumOfCountsOverTheSumOfTimes) {
    const MergedExposures m = merged({1, 2, 5}, {12, 18, 51}, 1, {1, 0, 0, 1000, 0});
    EXPECT_NEAR(m.rate[0], (11 + 17 + 50) / 8.0, 1e-5);
    EXPECT_NEAR(m.variance[0], 10 / 8.0,
                1e-5);  // of a rate of 10 over 8 s, estimated from the longest exposure
}

TEST(Merge, ReadNoiseAlone_WeighsByTheSquareOfTimes) {
    const MergedExposures m = merged({1, 2}, {100, 210}, 0, {0, 3, 0, 1000, 0});
    EXPECT_NEAR(m.rate[0], (1 * 100 + 4 * 105) / 5.0, 1e-4);
    EXPECT_NEAR(m.variance[0], 9 / 5.0, 1e-5);
}

TEST(Merge, FullAndBlackExposures_AreLeftOut) {
    const CountNoise noise{1, 0, 1, 255, 0};
    EXPECT_NEAR(merged({1, 10, 100}, {20, 200, 255}, 0, noise).rate[0], 20, 1e-5);
    // At a rate of 0.5 the first exposure is black in most draws, so it carries no information about the
    // mean.
    EXPECT_NEAR(merged({1, 200}, {0, 100}, 0, noise).rate[0], 0.5, 1e-5);
    EXPECT_TRUE(merged({1, 10}, {20, 255}, 0, noise).saturated.empty());
}

TEST(Merge, FullInAll_IsALowerBoundAndCounted) {
    const MergedExposures m = merged({0.5, 1}, {255, 255}, 5, {1, 0, 1, 255, 0});
    EXPECT_THAT(m.saturated, ElementsAre(0U));
    EXPECT_NEAR(m.rate[0], 500, 1e-4);
}

TEST(Merge, NoLightNoNoise_IsZeroAndFinite) {
    const MergedExposures m = merged({0.5, 1}, {0, 0}, 0, {1, 0, 0, 255, -1});
    EXPECT_EQ(m.rate[0], 0);
    EXPECT_EQ(m.variance[0], 0);
}

// Over four decades of light the mean is the light and the variance is the predicted one.
TEST(Merge, SimulatedCamera_IsUnbiasedWithThePredictedVariance) {
    CameraModel camera;
    camera.bits = 12;
    camera.full_well = 20000;
    camera.read_noise = 15;
    camera.shot_noise = true;
    const CountScale scale(camera);
    const std::vector<double> seconds{0.01, 0.1, 1};
    const CountNoise noise{scale.gain, camera.read_noise * scale.gain, 1, 4095 - 6 * 15 * scale.gain, 0};
    for (const double electrons_per_second : {20.0, 3000.0, 60000.0, 900000.0}) {
        constexpr int kRuns = 20000;
        RunningStats rate;
        double predicted = 0;
        for (int i = 0; i < kRuns; ++i) {
            Sampler sampler(7, Purpose::test, static_cast<std::uint32_t>(electrons_per_second),
                            static_cast<std::uint64_t>(i));
            std::vector<float> counts;
            for (const double t : seconds)
                counts.push_back(simulated_count(electrons_per_second * t, camera, scale, sampler));
            const MergedExposures m = merged(seconds, counts, static_cast<float>(scale.pedestal), noise);
            rate.add(double{m.rate[0]});
            predicted += double{m.variance[0]} / kRuns;
        }
        const double truth = electrons_per_second * scale.gain;
        EXPECT_TRUE(testing::agrees(rate, truth)) << electrons_per_second << ": " << rate.mean() << " for "
                                                  << truth << " ± " << rate.standard_error();
        EXPECT_FALSE(testing::agrees(rate, truth * (1 + 6 * rate.standard_error() / truth)));
        EXPECT_NEAR(rate.variance(), predicted, 0.05 * predicted) << electrons_per_second;
    }
}

TEST(Poisson, BelowAndAboveTheSwitch_HasItsProbabilities) {
    for (const double mean : {0.3, 4.0, 63.9, 64.1, 500.0}) {
        constexpr int kDraws = 50000;
        const auto last = static_cast<std::size_t>(mean + 8 * std::sqrt(mean) + 12);
        std::vector<std::uint64_t> seen(last + 1);
        std::vector<double> expected(last + 1);
        for (int i = 0; i < kDraws; ++i) {
            Sampler sampler(1, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const auto k = static_cast<std::size_t>(poisson(mean, sampler));
            ++seen[std::min(k, last)];
        }
        for (std::size_t k = 0; k <= last; ++k) {
            const auto x = static_cast<double>(k);
            expected[k] = kDraws * std::exp(x * std::log(mean) - mean - std::lgamma(x + 1));
        }
        EXPECT_TRUE(testing::chi_square(seen, expected).accepted()) << mean;
        for (double& e : expected) e = 0;
        for (std::size_t k = 0; k <= last; ++k) {
            const auto x = static_cast<double>(k);
            expected[k] = kDraws * std::exp(x * std::log(1.05 * mean) - 1.05 * mean - std::lgamma(x + 1));
        }
        EXPECT_FALSE(testing::chi_square(seen, expected).accepted())
            << mean << ": another mean is not told apart";
    }
}

}  // namespace exposure_test
}  // namespace lucerna
