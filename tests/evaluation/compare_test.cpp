#include "engine/evaluation/compare.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <random>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace compare_test {

// Returns two pixels of one channel, so that every number below can be computed by hand.
Image pair_of(float a, float b) {
    Image image(2, 1, {"Y"});
    image.data = {a, b};
    return image;
}

TEST(Compare, TwoPixels_EqualsHandNumbers) {
    const Comparison c = compare(pair_of(1, 5), pair_of(2, 3));
    EXPECT_NEAR(c.mse, (1 + 4) / 2.0, 1e-12);
    EXPECT_NEAR(c.relative_mse, (1 / 4.0001 + 4 / 9.0001) / 2, 1e-12);
    EXPECT_NEAR(c.mape, (1 / 2.01 + 2 / 3.01) / 2, 1e-12);
    // The mean of the reference is 2.5, a tenth of it 0.25.
    EXPECT_NEAR(c.error, std::sqrt((1 / 4.0625 + 4 / 9.0625) / 2), 1e-12);
    ASSERT_EQ(c.channels.size(), 1U);
    EXPECT_NEAR(c.channels[0].mean, 3, 1e-12);
    EXPECT_NEAR(*c.channels[0].ratio, 3 / 2.5, 1e-12);
    EXPECT_EQ(c.largest.value, 2);
    EXPECT_EQ(c.largest.x, 1);
    EXPECT_EQ(c.largest.y, 0);
    EXPECT_EQ(c.largest.channel, "Y");
    EXPECT_EQ(c.pixels, 2U);
    EXPECT_FALSE(c.z_test);
}

TEST(Compare, BlackReference_HasNoRatioAndFiniteErrors) {
    const Comparison c = compare(pair_of(0.01F, 0), pair_of(0, 0));
    EXPECT_FALSE(c.channels[0].ratio);
    EXPECT_NEAR(c.relative_mse, 0.5, 1e-6);  // 0.01² / 1e-4 = 1 in one of two pixels
    EXPECT_NEAR(c.mape, 0.5, 1e-6);
}

TEST(Compare, ImageWithItself_DiffersByNothing) {
    Image image = Image::rgb(3, 2);
    for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i);
    const Comparison c = compare(image, image);
    EXPECT_EQ(c.mse, 0);
    EXPECT_EQ(c.relative_mse, 0);
    EXPECT_EQ(c.mape, 0);
    EXPECT_EQ(c.largest.channel, "");
    for (const ChannelComparison& channel : c.channels) EXPECT_EQ(channel.ratio, 1);
}

TEST(Compare, NotFinitePixels_AreCountedAndLeftOut) {
    Image image = Image::rgb(2, 2);
    Image reference = Image::rgb(2, 2);
    for (float& v : image.data) v = 1;
    for (float& v : reference.data) v = 1;
    image.value(0, 0, 0) = NAN;
    image.value(0, 0, 1) = INFINITY;  // the same pixel counts once
    reference.value(1, 1, 2) = -INFINITY;
    const Comparison c = compare(image, reference);
    EXPECT_EQ(c.bad_pixels, 1U);
    EXPECT_EQ(c.bad_reference_pixels, 1U);
    EXPECT_EQ(c.pixels, 2U);
    EXPECT_EQ(c.mse, 0);
    EXPECT_EQ(c.channels[0].mean, 1);
}

TEST(Compare, Mask_LeavesOutWhereTheReferenceIsBrighter) {
    Image image = Image::rgb(2, 1);
    Image reference = Image::rgb(2, 1);
    reference.set_rgb(0, 0, Rgb(0.5F, 4.5F, 0.5F));  // one channel is enough
    image.set_rgb(1, 0, Rgb(9));                     // the image's own brightness is ignored
    const Comparison c = compare(image, reference, "image", "reference", 4);
    EXPECT_EQ(c.masked_pixels, 1U);
    EXPECT_EQ(c.pixels, 1U);
    EXPECT_EQ(c.mse, 81);
    EXPECT_EQ(compare(image, reference, "image", "reference", 5).masked_pixels, 0U);
}

TEST(Compare, NothingFinite_GivesNoNumbersButCounts) {
    const Comparison c = compare(pair_of(NAN, NAN), pair_of(1, 1));
    EXPECT_EQ(c.bad_pixels, 2U);
    EXPECT_EQ(c.pixels, 0U);
    EXPECT_TRUE(std::isfinite(c.mse));
}

TEST(Compare, DifferentSizes_IsRefusedWithBoth) {
    try {
        compare(Image::rgb(2, 1), Image::rgb(1, 2), "a.exr", "b.exr");
        FAIL() << "no error";
    } catch (const InputError& error) {
        EXPECT_STREQ(
            error.what(),
            "a.exr: 2 x 1 pixels, but b.exr has 1 x 2; only images of the same size can be compared");
    }
    EXPECT_THROW(compare(Image(1, 1, {"R"}), Image(1, 1, {"Y"})), InputError);
}

TEST(Compare, ChannelsOfOneImageOnly_AreNamed) {
    const Comparison c = compare(Image(1, 1, {"R", "Z", "A"}), Image(1, 1, {"R", "Q", "variance.R"}));
    EXPECT_EQ(c.left_out, (std::vector<std::string>{"Z", "Q"}));
    EXPECT_EQ(c.channels.size(), 1U);
}

TEST(Compare, ChannelOrder_DoesNotMatter) {
    Image a(1, 1, {"R", "G"});
    Image b(1, 1, {"G", "R"});
    a.data = {1, 2};
    b.data = {2, 1};
    EXPECT_EQ(compare(a, b).mse, 0);
}

TEST(Sidak, HandNumbers_Hold) {
    EXPECT_NEAR(sidak_level(0.05, 1), 0.05, 1e-15);
    EXPECT_NEAR(sidak_level(0.05, 2), 1 - std::sqrt(0.95), 1e-15);
    EXPECT_NEAR(sidak_p_value(0.5, 2), 0.75, 1e-15);
    EXPECT_NEAR(sidak_p_value(sidak_level(0.01, 1'000'000), 1'000'000), 0.01, 1e-12);
    EXPECT_GT(sidak_p_value(1e-20, 1'000'000), 0);  // no cancellation to 0
    EXPECT_EQ(sidak_p_value(1, 5), 1);
    EXPECT_EQ(sidak_p_value(0.3, 0), 1);
}

// Returns a render of the constant image `truth` with known Gaussian noise in every pixel.
Image noisy(int size, double truth, double sigma, std::mt19937_64& generator) {
    Image image(size, size, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    std::normal_distribution<double> noise(truth, sigma);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            for (int c = 0; c < 3; ++c) {
                image.value(x, y, c) = static_cast<float>(noise(generator));
                image.value(x, y, c + 3) = static_cast<float>(sigma * sigma);
            }
        }
    }
    return image;
}

TEST(ZTest, OneValue_EqualsTheNormalTail) {
    Image a(1, 1, {"R", "variance.R"});
    Image b = a;
    a.data = {3, 0.5F};
    b.data = {1, 0.5F};  // z = 2 / sqrt(0.5 + 0.5)
    const Comparison c = compare(a, b);
    ASSERT_TRUE(c.z_test);
    const double p = 2 * boost::math::cdf(boost::math::complement(boost::math::normal(), 2.0));
    EXPECT_NEAR(c.z_test->smallest_p, p, 1e-12);
    EXPECT_NEAR(c.z_test->p_value, p, 1e-12);
    EXPECT_EQ(c.z_test->rejected, 0U);
}

TEST(ZTest, EqualImages_AreFalselyRejectedAsOftenAsItSays) {
    std::mt19937_64 generator(2003);
    constexpr int kRuns = 2000;
    std::uint64_t rejected = 0;
    for (int i = 0; i < kRuns; ++i) {
        const Comparison c = compare(noisy(8, 1, 0.1, generator), noisy(8, 1, 0.2, generator));
        rejected += c.z_test->p_value < 0.1;
    }
    // The rejections are binomial with 10 % of the runs: chi-square against {200, 1800}.
    const std::uint64_t observed[] = {rejected, kRuns - rejected};
    const double expected[] = {0.1 * kRuns, 0.9 * kRuns};
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted()) << rejected;
}

TEST(ZTest, OnePixelWrong_IsFound) {
    std::mt19937_64 generator(2004);
    Image a = noisy(64, 1, 0.1, generator);
    const Image b = noisy(64, 1, 0.1, generator);
    EXPECT_EQ(compare(a, b).z_test->rejected, 0U);
    a.value(17, 42, 1) += 1.5F;  // ten sigma of the difference
    const ZTest z = *compare(a, b).z_test;
    EXPECT_EQ(z.rejected, 1U);
    EXPECT_EQ(z.x, 17);
    EXPECT_EQ(z.y, 42);
    EXPECT_EQ(z.channel, "G");
    EXPECT_LT(z.p_value, 1e-6);
}

TEST(ZTest, DifferentWithoutVariance_IsCountedAsUntestable) {
    Image a(2, 1, {"R", "variance.R"});
    Image b = a;
    a.data = {1, 0, 1, 0};
    b.data = {1, 0, 2, 0};
    const ZTest z = *compare(a, b).z_test;
    EXPECT_EQ(z.tests, 0U);
    EXPECT_EQ(z.untestable, 1U);
    EXPECT_EQ(z.p_value, 1);
}

// Returns an image that is too bright by less than any single pixel shows.
Image biased(int size, double bias, double sigma, std::mt19937_64& generator) {
    return noisy(size, 1 + bias, sigma, generator);
}

TEST(ZVerdict, EqualImages_AreRejectedAtMostAsOftenAsItSays) {
    std::mt19937_64 generator(2005);
    constexpr int kRuns = 3000;
    std::uint64_t rejected = 0, at_a_tenth = 0;
    for (int i = 0; i < kRuns; ++i) {
        const ZTest z = *compare(noisy(16, 1, 0.1, generator), noisy(16, 1, 0.2, generator)).z_test;
        rejected += !z.equal();
        at_a_tenth += z.verdict_p < 0.1;
    }
    // The rejections must not exceed a binomial of the stated rate, nor be so few that the test has no power.
    EXPECT_GT(binomial_excess(rejected, kRuns, kComparisonLevel), testing::kFalseAlarm) << rejected;
    EXPECT_GT(binomial_excess(at_a_tenth, kRuns, 0.1), testing::kFalseAlarm) << at_a_tenth;
    EXPECT_GT(at_a_tenth, kRuns * 2 / 100U);
}

TEST(ZVerdict, ChannelsThatAreOne_KeepTheRate) {
    // For grey noise all three tests of a pixel are identical.
    std::mt19937_64 generator(2006);
    constexpr int kRuns = 2000;
    std::uint64_t at_a_tenth = 0;
    for (int i = 0; i < kRuns; ++i) {
        Image a = noisy(12, 1, 0.1, generator);
        const Image b = noisy(12, 1, 0, generator);
        for (std::size_t p = 0; p < a.data.size(); p += 6) a.data[p + 1] = a.data[p + 2] = a.data[p];
        at_a_tenth += compare(a, b).z_test->verdict_p < 0.1;
    }
    EXPECT_GT(binomial_excess(at_a_tenth, kRuns, 0.1), testing::kFalseAlarm) << at_a_tenth;
}

TEST(ZVerdict, BiasThatNoPixelShows_IsRejectedByTheSums) {
    std::mt19937_64 generator(2007);
    int rejected = 0;
    for (int i = 0; i < 50; ++i) {
        // The bias is a fifth of a pixel's deviation, hence five deviations of the mean of 32 x 32 pixels.
        const ZTest z = *compare(biased(32, 0.02, 0.1, generator), biased(32, 0, 0.01, generator)).z_test;
        rejected += !z.equal();
        if (!z.equal()) {
            EXPECT_EQ(z.answered_by, "mean");
        }
        EXPECT_NEAR(z.mean_z, 0.2, 5 * z.mean_z_error);
    }
    EXPECT_GE(rejected, 48);
}

TEST(ZVerdict, MoreNoiseThanStated_IsRejectedByTheTails) {
    std::mt19937_64 generator(2008);
    Image a = noisy(64, 1, 0.12, generator);
    for (std::size_t p = 0; p < a.data.size(); p += 6) a.data[p + 3] = a.data[p + 4] = a.data[p + 5] = 0.01F;
    const ZTest z = *compare(a, noisy(64, 1, 1e-4, generator)).z_test;
    EXPECT_FALSE(z.equal());
    EXPECT_EQ(z.answered_by, "beyond");
    EXPECT_GT(z.beyond[0].share, 1.5 * z.beyond[0].expected);
}

TEST(ZVerdict, Shares_AreThoseOfANormalVariate) {
    std::mt19937_64 generator(2009);
    const ZTest z = *compare(noisy(128, 1, 0.1, generator), noisy(128, 1, 0.1, generator)).z_test;
    EXPECT_NEAR(z.beyond[0].expected, 0.0455003, 1e-6);
    EXPECT_NEAR(z.beyond[1].expected, 0.0026998, 1e-6);
    EXPECT_NEAR(z.beyond[2].expected, 6.33425e-5, 1e-9);
    EXPECT_NEAR(z.beyond[0].share, z.beyond[0].expected, 0.005);
    EXPECT_NEAR(z.beyond[1].share, z.beyond[1].expected, 0.0012);
    EXPECT_NEAR(z.mean_z, 0, 4 * z.mean_z_error);
}

// Returns a render of `samples` samples that are mostly dark and rarely bright, as in caustics, and so far
// from normal.
Image spotty(int size, int samples, std::mt19937_64& generator) {
    Image image(size, size, {"R", "variance.R"});
    std::exponential_distribution<double> value(1);
    for (std::size_t p = 0; p < image.data.size(); p += 2) {
        RunningStats stats;
        for (int i = 0; i < samples; ++i) stats.add(std::pow(value(generator), 2));
        image.data[p] = static_cast<float>(stats.mean());
        image.data[p + 1] = static_cast<float>(sqr(stats.standard_error()));
    }
    return image;
}

TEST(ZVerdict, FewSkewedSamples_NeedCells) {
    std::mt19937_64 generator(2010);
    int rejected = 0, rejected_by_cells = 0;
    constexpr int kRuns = 40;
    for (int i = 0; i < kRuns; ++i) {
        const Image a = spotty(64, 8, generator), b = spotty(64, 64, generator);
        rejected += !compare(a, b).z_test->equal();
        rejected_by_cells += !compare(a, b, "a", "b", INFINITY, 16).z_test->equal();
    }
    EXPECT_GT(rejected, kRuns * 9 / 10);  // this is the reason for cells
    EXPECT_LE(rejected_by_cells, 3);      // 0.4 expected; 4 or more: p = 7e-4
}

TEST(ZVerdict, Cells_AreTheirPixelsSums) {
    Image a(3, 2, {"R", "variance.R"});
    Image b = a;
    for (std::size_t p = 0; p < 6; ++p) a.data[2 * p] = static_cast<float>(p), a.data[2 * p + 1] = 0.5F;
    const ZTest z = *compare(a, b, "a", "b", INFINITY, 2).z_test;
    EXPECT_EQ(z.tests, 2U);  // columns 0 and 1, and column 2
    EXPECT_EQ(z.cell, 2);
    EXPECT_NEAR(z.mean_z, ((0 + 1 + 3 + 4) / std::sqrt(2.0) + (2 + 5) / 1.0) / 2, 1e-6);
    EXPECT_EQ(z.x, 2);
}

TEST(Binomial, Excess_EqualsTheSum) {
    const boost::math::binomial distribution(50, 0.1);
    for (const unsigned k : {6U, 8U, 12U, 50U}) {
        const double tail = boost::math::cdf(boost::math::complement(distribution, k - 1));
        EXPECT_NEAR(binomial_excess(k, 50, 0.1) / tail, 1, 1e-9) << k;
    }
    EXPECT_EQ(binomial_excess(5, 50, 0.1), 1);  // the mean is not significant
    EXPECT_EQ(binomial_excess(0, 0, 0.1), 1);
    EXPECT_GT(binomial_excess(3000, 1'000'000, 0.0027), 0);
    EXPECT_LT(binomial_excess(3000, 1'000'000, 0.0027), 1e-7);
}

// Layers beside the light are not colours, so their contents must not affect the comparison.
TEST(Compare, LayersBesideColours_AreNotCompared) {
    Image plain(2, 1, {"R", "G", "B"}), layered(2, 1, {"R", "G", "B", "Z", "denoised.R", "emitter.Y"});
    for (int x = 0; x < 2; ++x) {
        plain.set_rgb(x, 0, Rgb(1.0F + static_cast<float>(x)));
        layered.set_rgb(x, 0, Rgb(1.0F));
        layered.value(x, 0, 3) = layered.value(x, 0, 4) = layered.value(x, 0, 5) =
            1000.0F * static_cast<float>(x);
    }
    Image other = layered;
    other.value(0, 0, 3) = 7;
    EXPECT_EQ(compare(layered, other, "a", "b").mse, 0);
    const Comparison c = compare(layered, plain, "a", "b");
    EXPECT_EQ(c.channels.size(), 3U);
    EXPECT_NEAR(c.mse, 0.5, 1e-12);
    EXPECT_TRUE(c.left_out.empty());
}

}  // namespace compare_test
}  // namespace lucerna
