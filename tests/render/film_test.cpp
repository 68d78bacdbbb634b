#include "engine/render/film.h"

#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace film_test {

TEST(Film, MeanAndVarianceOfTheMean_EqualTwoPassSums) {
    Film film(2, 1);
    Sampler sampler(1, Purpose::test, 0, 0);
    RunningStats expected;
    for (int i = 0; i < 100; ++i) {
        const float value = 1000 + sampler.next();
        expected.add(static_cast<double>(value));
        film.add(1, 0, Rgb(value));
    }
    const Image image = film.develop(2);
    EXPECT_NEAR(image.value(1, 0, 0), 2 * expected.mean(), 1e-3);
    EXPECT_NEAR(image.value(1, 0, 3), 4 * expected.variance() / 100, 0.01 * 4 * expected.variance() / 100);
    EXPECT_EQ(image.value(0, 0, 0), 0);
    EXPECT_EQ(image.value(0, 0, 3), 0);
}

// Signed weights are exact for constants and unbiased otherwise, with the observed variance.
TEST(Film, SignedWeights_AreExactOnConstantsAndUnbiased) {
    constexpr int kPixels = 4'000, kSamples = 64;
    constexpr float kWeight = 1.5F;  // + with probability 5/6, - with 1/6: mean 1
    Film film(kPixels + 1, 1, {.weight = kWeight});
    Sampler sampler(11, Purpose::test, 0, 0);
    for (int x = 0; x <= kPixels; ++x) {
        for (int s = 0; s < kSamples; ++s) {
            const float u = sampler.next();
            const float weight = sampler.next() < 5.0F / 6 ? kWeight : -kWeight;
            // The radiance depends on the sign of the weight: E[w L] = 5/6 · 1.5 · 3.5 - 1/6 · 1.5 · 0.5 =
            // 4.25.
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

// With two samples, of which one meets light, the covariance of weights and radiances is as uncertain as it
// is large. The variance must nevertheless be right on average, and never 0.
TEST(Film, SignedWeightsOfFewSamples_HaveTheirVariance) {
    constexpr int kPixels = 20'000;
    constexpr float kWeight = 1.5F, kPositive = 5.0F / 6;
    for (const int samples : {2, 4, 16}) {
        Film film(kPixels, 1, {.weight = kWeight});
        Sampler sampler(19, Purpose::test, 0, static_cast<std::uint64_t>(samples));
        std::vector<bool> lit(kPixels);
        for (int x = 0; x < kPixels; ++x) {
            for (int s = 0; s < samples; ++s) {
                const float radiance = sampler.next() < 0.1F ? 10.0F : 0.0F;
                if (radiance > 0) lit[static_cast<std::size_t>(x)] = true;
                film.add(x, 0, Rgb(radiance), sampler.next() < kPositive ? kWeight : -kWeight);
            }
        }
        const Image image = film.develop(1);
        RunningStats value, variance;
        for (int x = 0; x < kPixels; ++x) {
            value.add(double{image.value(x, 0, 0)});
            variance.add(double{image.value(x, 0, 3)});
            if (lit[static_cast<std::size_t>(x)] && image.value(x, 0, 0) != 10) {
                EXPECT_GT(image.value(x, 0, 3), 0) << x;
            }
        }
        EXPECT_TRUE(testing::agrees(value, 1));
        EXPECT_GT(variance.mean() / value.variance(), 0.85) << samples;
        EXPECT_LT(variance.mean() / value.variance(), 1.2) << samples;
    }
}

// If all samples of a pass are alike they carry the information of one. The variance between passes is the
// observed one; the variance between samples would be too small by their number.
TEST(Film, SamplesOfAPassDependOnEachOther_VarianceIsTakenBetweenPasses) {
    constexpr int kPixels = 4'000, kPasses = 16, kSamples = 8;
    Film by_pass(kPixels, 1, {.by_pass = true}), by_sample(kPixels, 1);
    Sampler sampler(12, Purpose::test, 0, 0);
    for (int x = 0; x < kPixels; ++x) {
        for (int p = 0; p < kPasses; ++p) {
            const std::vector<Film::Sample> samples(kSamples, {Rgb(sampler.next()), 1});
            by_pass.add_pass(x, 0, samples);
            for (const Film::Sample& sample : samples) by_sample.add(x, 0, sample.radiance);
        }
    }
    const Image image = by_pass.develop(1), naive = by_sample.develop(1);
    RunningStats value, variance, wrong;
    for (int x = 0; x < kPixels; ++x) {
        EXPECT_EQ(image.value(x, 0, 0), naive.value(x, 0, 0));
        value.add(double{image.value(x, 0, 0)});
        variance.add(double{image.value(x, 0, 3)});
        wrong.add(double{naive.value(x, 0, 3)});
    }
    EXPECT_NEAR(variance.mean() / value.variance(), 1, 0.1);
    EXPECT_NEAR(wrong.mean() / value.variance(), 1.0 / kSamples, 0.03);
}

// The halves of an allocated film start with one sample each; their difference estimates the variance of
// their mean, which must not be 0. With so few samples the film states no error; from four on it does.
TEST(Film, HalvesOfOneSample_HaveTheVarianceOfWhatTheyDifferBy) {
    constexpr int kSide = 100;
    for (const int samples : {2, 3, 4, 8}) {
        Film film(kSide, kSide, {.two_halves = true, .allocated = true});
        Sampler sampler(21, Purpose::test, 0, static_cast<std::uint64_t>(samples));
        for (int i = 0; i < kSide * kSide; ++i) {
            for (int s = 0; s < samples; ++s)
                film.add(i % kSide, i / kSide, Rgb(2 * sampler.next()), 1, s % 2);
        }
        const Image image = film.develop(1);
        RunningStats variance, value;
        for (int i = 0; i < kSide * kSide; ++i) {
            value.add(double{image.value(i % kSide, i / kSide, 0)});
            variance.add(double{image.value(i % kSide, i / kSide, 3)});
        }
        // The mean of halves of 1 and 2 samples has (1 + 1/2)/4 of one sample's variance 1/3.
        const double truth = samples == 3 ? 1.0 / 8 : 1.0 / 3 / samples;
        EXPECT_NEAR(value.variance() / truth, 1, 0.05) << samples;
        EXPECT_NEAR(variance.mean() / truth, 1, 0.06) << samples;
        EXPECT_EQ(std::isinf(film.relative_error()), samples < 4) << samples;
        if (samples >= 4) {
            EXPECT_NEAR(film.relative_error() / std::sqrt(truth / 1.01), 1, samples == 4 ? 0.3 : 0.2);
        }
    }
}

// Filters with negative lobes must not add variance to constant light.
TEST(Film, PassesOfSignedWeights_AreExactOnConstants) {
    Film film(1, 1, {.weight = 1.5F, .by_pass = true});
    Sampler sampler(13, Purpose::test, 0, 0);
    for (int p = 0; p < 20; ++p) {
        std::vector<Film::Sample> samples;
        for (int s = 0; s < 4; ++s) samples.push_back({Rgb(7.0F), sampler.next() < 5.0F / 6 ? 1.5F : -1.5F});
        film.add_pass(0, 0, samples);
    }
    EXPECT_EQ(film.develop(1).value(0, 0, 0), 7);
    EXPECT_EQ(film.develop(1).value(0, 0, 3), 0);
}

// Uniform samples in [0, 2) have mean 1 and variance 1/3. The floor adds (a tenth)² to the squares of values.
TEST(Film, RelativeError_IsTheStandardErrorOverTheValue) {
    Film film(50, 40);
    EXPECT_TRUE(std::isinf(film.relative_error()));
    Sampler sampler(14, Purpose::test, 0, 0);
    for (int s = 0; s < 25; ++s) {
        for (int y = 0; y < 40; ++y) {
            for (int x = 0; x < 50; ++x) film.add(x, y, Rgb(2 * sampler.next()));
        }
        if (s == 0) {
            EXPECT_TRUE(std::isinf(film.relative_error())) << "one sample says nothing";
        }
    }
    EXPECT_NEAR(film.relative_error(), std::sqrt(1.0 / 3 / 25 / 1.01), 0.004);
    Film black(2, 2);
    for (int i = 0; i < 16; ++i) black.add(i % 2, i / 2 % 2, Rgb(0));
    EXPECT_EQ(black.relative_error(), 0) << "it will not get better";
}

// Stratified samples have a smaller error than their variance suggests; independent samples do not.
TEST(Film, RelativeError_KnowsOfStratification) {
    for (const bool stratified : {false, true}) {
        Film film(50, 40);
        double square = 0;
        for (int pixel = 0; pixel < 2000; ++pixel) {
            const auto family = static_cast<std::uint64_t>(pixel);
            Sampler independent(15, Purpose::test, 0, family);
            double mean = 0;
            for (std::uint32_t s = 0; s < 64; ++s) {
                Sampler one = Sampler::stratified(15, Purpose::test, family, s);
                const float u = stratified ? one.next() : independent.next();
                film.add(pixel % 50, pixel / 50, Rgb(2 * u));
                mean += double{2 * u} / 64;
            }
            square += sqr(mean - 1) / 2000;
        }
        const double actual = std::sqrt(square / 1.01);
        EXPECT_GT(film.relative_error(), actual / 1.5);
        // One sample in each of 64 strata is 8 times better than 64 independent ones. Two halves of so smooth
        // an integrand (whose variance falls with the third power of their number) overstate it by √7; the
        // rest is margin.
        EXPECT_LT(film.relative_error(), (stratified ? 3.3 : 1.1) * actual);
    }
}

// One sample in a thousand is as bright as ten thousand others. Relative to the pixels that contain it, the
// error would be a tenth of the true one; therefore such a pixel is judged by its neighbours' level.
TEST(Film, RelativeError_OfFireflies_IsThatOfThePixelsWithoutThem) {
    constexpr int kWidth = 200, kHeight = 150, kSamples = 16;
    Film film(kWidth, kHeight);
    Sampler sampler(16, Purpose::test, 0, 0);
    double square = 0, by_itself = 0;
    constexpr double kMean = 1 + 1e-4 * 1000;
    for (int i = 0; i < kWidth * kHeight; ++i) {
        double mean = 0;
        for (int s = 0; s < kSamples; ++s) {
            const float value = sampler.next() < 1e-4F ? 1001.0F : 1.0F;
            film.add(i % kWidth, i / kWidth, Rgb(value));
            mean += double{value} / kSamples;
        }
        square += sqr(mean - kMean) / (kWidth * kHeight) / (1.01 * sqr(kMean));
        by_itself += sqr(mean - kMean) / (kWidth * kHeight) / (sqr(mean) + 0.01 * sqr(kMean));
    }
    const double actual = std::sqrt(square);
    // Both errors are sums over the same fireflies, so chance cancels in their ratio: a pixel's own variance
    // is (1000/16)², the square of its error (1000/16 - 0.1)². The film judges such a pixel by its neighbours
    // and divides by 1 and the floor where the truth divides by the mean and the floor.
    const double share = 62.5 / 62.4 * std::sqrt(1.01 * sqr(kMean) / (1 + 0.01 * sqr(kMean)));
    EXPECT_NEAR(film.relative_error() / actual, share, 0.02);  // two in one pixel occur once in 25 such films
    EXPECT_LT(std::sqrt(by_itself), 0.1 * actual) << "what this test is to refuse";
}

TEST(Film, AnyNumberOfThreads_DevelopsTheSameBits) {
    constexpr int kWidth = 37, kHeight = 53;
    Film film(kWidth, kHeight, {.two_halves = true, .allocated = true, .tells_blur = true});
    Sampler sampler(21, Purpose::test, 0, 0);
    const auto add = [&](int x, int y, int samples) {
        for (int s = 0; s < samples; ++s)
            film.add(x, y, Rgb(sampler.next(), sampler.next(), sampler.next()), 1, s & 1, sampler.next());
    };
    for (int y = 0; y < kHeight; y += 2) {
        for (int x = 0; x < kWidth; x += 2) add(x, y, 5);
    }
    const Workers one{1}, three{3};
    EXPECT_EQ(film.spacing(three), 2);
    for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) add(x, y, 3 + (x + y) % 4);
    }
    EXPECT_EQ(film.spacing(three), 1);
    EXPECT_EQ(film.develop(2, {}, three).data, film.develop(2, {}, one).data);
    EXPECT_EQ(film.develop_half(1, 2, {}, three).data, film.develop_half(1, 2, {}, one).data);
    const Film::ErrorEstimate of_one = film.error(one), of_three = film.error(three);
    EXPECT_GT(of_one.relative, 0);
    EXPECT_EQ(of_three.relative, of_one.relative);
    EXPECT_GT(of_one.blur, 0);
    EXPECT_EQ(of_three.blur, of_one.blur);
}

// A bright pixel in which all samples agree is not a firefly, however dark its surroundings.
TEST(Film, RelativeError_BesideABrightPixel_IsRelativeToThatPixel) {
    Film film(9, 9);
    Sampler sampler(17, Purpose::test, 0, 0);
    for (int s = 0; s < 256; ++s) {
        for (int i = 0; i < 81; ++i)
            film.add(i % 9, i / 9, Rgb((i == 40 ? 1e4F : 1e-3F) * (0.5F + sampler.next())));
    }
    // The floor, a tenth of the mean, is 12, so the dark pixels' errors are negligible and one pixel
    // dominates. The deviation of 256 uniform values is known to √((9/5 - 1)/256)/2 = 2.8 %, the level of its
    // halves to 2.6 %, together 3.8 %; the tolerance is four of these.
    const double truth = std::sqrt(1.0 / 12 / 256 / 81);
    EXPECT_NEAR(film.relative_error(), truth, 4 * 0.038 * truth);
}

// A lamp that only one sample of a pixel meets: that pixel is excluded and named, and the error is that of
// the others, relative to the others. If one pixel in a hundred is bright, the image itself is noisy.
TEST(Film, RelativeError_WherePixelsSeeASmallLamp_IsThatOfTheOthers) {
    constexpr int kSide = 60;
    for (const int lamps : {0, 1, 3, 36}) {
        Film film(kSide, kSide);
        Sampler sampler(18, Purpose::test, 0, 0);
        for (int s = 0; s < 32; ++s) {
            for (int i = 0; i < kSide * kSide; ++i) {
                const bool sees = i % 100 == 17 && i / 100 < lamps && s == 5;
                film.add(i % kSide, i / kSide, Rgb(sees ? 1e6F : 2 * sampler.next()));
            }
        }
        const Film::ErrorEstimate error = film.error();
        if (lamps < 4) {
            EXPECT_NEAR(error.relative, std::sqrt(1.0 / 3 / 32 / 1.01), 0.004) << lamps;
            ASSERT_EQ(error.apart.size(), static_cast<std::size_t>(lamps));
            if (lamps > 0) {
                EXPECT_EQ(error.apart.front(), V2i(17, 0));
            }
        } else {
            EXPECT_GT(error.relative, 1);
            EXPECT_TRUE(error.apart.empty());
        }
    }
}

class Filters : public ::testing::TestWithParam<FilterSettings::Kind> {};

// Compares the binned offsets with the integral of the filter over each bin.
TEST_P(Filters, Offsets_FollowTheFilter) {
    FilterSettings settings;
    settings.kind = GetParam();
    settings.radius = {1.5F, 2};
    const FilterSampler filter_sampler(settings);
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
    Sampler sampler(3, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V2f offset = filter_sampler.sample(sampler.next2()).offset;
        ASSERT_LE(std::fabs(offset.x), 1.5F);
        ASSERT_LE(std::fabs(offset.y), 2.0F);
        const int bin = static_cast<int>((offset.x / 1.5F + 1) / 2 * kBins);
        ++observed[static_cast<std::size_t>(std::clamp(bin, 0, kBins - 1))];
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());
    // The test must reject a filter that leans to one side by 4 %.
    for (int i = 0; i < kBins; ++i) expected[static_cast<std::size_t>(i)] *= i < kBins / 2 ? 1.04 : 0.96;
    EXPECT_FALSE(testing::chi_square(observed, expected).accepted());
}

INSTANTIATE_TEST_SUITE_P(All, Filters,
                         ::testing::Values(FilterSettings::Kind::box, FilterSettings::Kind::triangle,
                                           FilterSettings::Kind::gaussian));

// With signed weights the moments of the samples are the filter's own, including negative lobes.
TEST(Filters, WithNegativeLobes_KeepTheirMoments) {
    for (const auto kind : {FilterSettings::Kind::mitchell, FilterSettings::Kind::sinc}) {
        FilterSettings settings;
        settings.kind = kind;
        settings.radius = {2, 3};
        const FilterSampler filter_sampler(settings);
        RunningStats sum, second;
        Sampler sampler(5, Purpose::test, 0, 0);
        for (int i = 0; i < 400'000; ++i) {
            const auto [offset, weight] = filter_sampler.sample(sampler.next2());
            sum.add(static_cast<double>(weight));
            second.add(static_cast<double>(weight * offset.x * offset.x));
        }
        EXPECT_TRUE(testing::agrees(sum, 1.0));
        // Computes ∫ x² f / ∫ f by quadrature, with an independent implementation of each filter.
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

// If 40 of 4096 pixels dominate, the mean of squares has a standard error of 2 / sqrt(40) of twice that mean,
// 0.22; if all count equally, 0.02.
TEST(Film, ErrorThatFewPixelsDecide_IsNotStated) {
    constexpr int kSide = 64, kSamples = 16;
    for (const bool fireflies : {false, true}) {
        Film film(kSide, kSide, {1, false, true});
        Sampler sampler(9, Purpose::test, 0, 0);
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                const bool wild = fireflies && (y * kSide + x) % 100 == 0;
                for (int s = 0; s < kSamples; ++s)
                    film.add(x, y, Rgb(1 + (wild ? 10.0F : 0.1F) * (sampler.next() - 0.5F)), 1, s % 2);
            }
        }
        const Film::ErrorEstimate error = film.error();
        EXPECT_TRUE(error.apart.empty());
        EXPECT_EQ(error.is_known, !fireflies);
    }
}

}  // namespace film_test
}  // namespace lucerna
