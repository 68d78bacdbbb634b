// The error measure of a study: its value and its invariances.
#include "engine/evaluation/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "engine/base/error.h"
#include "engine/evaluation/compare.h"
#include "engine/render/film.h"

namespace lucerna {
namespace study_measure_test {

using ::testing::HasSubstr;

constexpr double kNoMask = std::numeric_limits<double>::infinity();

struct Listener : Monitor {
    std::vector<std::string> warnings;
    void warn(std::string_view line) override { warnings.emplace_back(line); }
};

// Returns a grey image without variances.
NamedImage flat(float radiance, int side = 8) {
    NamedImage one{"flat", Image::rgb(side, side)};
    for (float& v : one.image.data) v = radiance;
    return one;
}

// Returns a structured image with relative noise of the given size, in an arbitrary unit.
NamedImage noisy(unsigned seed, double bias, double noise, double unit) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    NamedImage one{"noisy", Image::rgb(32, 32)};
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const double value = (0.1 + 0.05 * x) * (bias + noise * normal(random));
            one.image.set_rgb(x, y, Rgb(static_cast<float>(unit * value)));
        }
    }
    return one;
}

StudyResult measured(const std::vector<NamedImage>& images, const NamedImage& reference,
                     double mask = kNoMask) {
    StudyResult result;
    Monitor silent;
    StudyMeasure(reference, mask).measure(images, result, silent);
    return result;
}

TEST(StudyMeasure, Error_OfAnEvenDifference_IsItsShare) {
    const StudyResult result = measured({flat(1.1F)}, flat(1));
    EXPECT_NEAR(result.error(), 0.1 / std::sqrt(1 + 0.01), 1e-6);
    EXPECT_NEAR(result.mean_ratio, 1.1, 1e-6);
}

TEST(StudyMeasure, BiasAndNoise_AreThoseThatWerePutIn) {
    std::vector<NamedImage> images;
    for (unsigned seed = 1; seed <= 6; ++seed) images.push_back(noisy(seed, 1.05, 0.2, 1));
    const StudyResult result = measured(images, noisy(0, 1, 0, 1));
    ASSERT_TRUE(result.bias2 && result.noise2 && result.error2_error);
    // Computes the share of each pixel's relative square that the floor, a tenth of the mean, leaves.
    double kept = 0;
    for (int x = 0; x < 32; ++x) {
        const double v2 = sqr(0.1 + 0.05 * x);
        kept += v2 / (v2 + sqr(0.1 * (0.1 + 0.05 * 15.5))) / 32;
    }
    EXPECT_NEAR(result.noise2->value, 0.2 * 0.2 * kept, 4 * *result.noise2->error);
    EXPECT_NEAR(result.bias2->value, 0.05 * 0.05 * kept, 4 * *result.bias2->error);
    EXPECT_GT(result.bias2->value, 4 * *result.bias2->error);
    EXPECT_NEAR(result.error2, result.bias2->value + result.noise2->value, 1e-9);
}

TEST(StudyMeasure, Error_InAnyUnit_IsTheSame) {
    const auto in_unit = [](double unit) {
        std::vector<NamedImage> images;
        for (unsigned seed = 1; seed <= 3; ++seed) images.push_back(noisy(seed, 1.1, 0.3, unit));
        return measured(images, noisy(0, 1, 0, unit));
    };
    const StudyResult one = in_unit(1);
    for (const double unit : {1e-12, 1e-6, 1e3, 1e12}) {
        SCOPED_TRACE(unit);
        const StudyResult other = in_unit(unit);
        EXPECT_NEAR(other.error2 / one.error2, 1, 1e-4);
        EXPECT_NEAR(other.bias2->value / one.bias2->value, 1, 1e-3);
        EXPECT_NEAR(other.noise2->value / one.noise2->value, 1, 1e-4);
        EXPECT_NEAR(other.mean_ratio / one.mean_ratio, 1, 1e-6);
    }
    // The invariance is not trivial: the floor of compare() is a radiance.
    const auto absolute = [](double unit) {
        return compare(noisy(1, 1.1, 0.3, unit).image, noisy(0, 1, 0, unit).image).relative_mse;
    };
    EXPECT_LT(absolute(1e-6), 0.01 * absolute(1));
}

// "2 %" of a study and of `render --error` must be the same quantity.
TEST(StudyMeasure, Noise_IsWhatAFilmSaysOfItself) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(0, 2);
    constexpr int kFilms = 4;
    std::vector<Film> films(kFilms, Film(32, 32));
    NamedImage truth{"truth", Image::rgb(32, 32)};
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            const float level = 0.05F + 0.1F * static_cast<float>(x);
            truth.image.set_rgb(x, y, Rgb(level));
            for (Film& film : films) {
                for (int i = 0; i < 64; ++i) film.add(x, y, Rgb(level * uniform(random)));
            }
        }
    }
    double stated = 0;
    std::vector<NamedImage> images;
    for (const Film& film : films) {
        stated += film.relative_error() / kFilms;
        images.push_back({"film", film.develop(1)});
    }
    EXPECT_NEAR(measured(images, truth).error(), stated, 0.05 * stated);
}

TEST(StudyMeasure, ReferencesNoise_IsStatedAndNotInTheBias) {
    NamedImage reference{"reference",
                         Image(32, 32, {"R", "G", "B", "variance.R", "variance.G", "variance.B"})};
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    for (int y = 0; y < 32; ++y) {
        for (int x = 0; x < 32; ++x) {
            reference.image.set_rgb(x, y, Rgb(1 + 0.1F * normal(random)));
            for (int c = 3; c < 6; ++c) reference.image.value(x, y, c) = 0.01F;
        }
    }
    const StudyResult result = measured({flat(1, 32), flat(1, 32), flat(1, 32)}, reference);
    EXPECT_NEAR(result.reference_noise2, 0.01, 0.001);
    EXPECT_NEAR(result.error2, 0.01, 0.002);
    EXPECT_NEAR(result.bias2->value, 0, 0.001);
}

TEST(StudyMeasure, LampsAndBadPixels_AreLeftOut) {
    NamedImage reference = flat(1), image = flat(1.1F);
    reference.image.set_rgb(3, 3, Rgb(1e6F));  // a directly visible lamp
    image.image.set_rgb(3, 3, Rgb(0));
    image.image.set_rgb(5, 5, Rgb(std::numeric_limits<float>::quiet_NaN()));
    StudyResult result;
    Listener listener;
    StudyMeasure(reference, 4).measure({image}, result, listener);
    EXPECT_NEAR(result.error(), 0.1 / std::sqrt(1 + 0.01), 1e-6);
    ASSERT_EQ(listener.warnings.size(), 1U);
    EXPECT_THAT(listener.warnings[0], HasSubstr("1 pixels are not finite"));
}

TEST(StudyMeasure, BlackReference_IsRefused) {
    try {
        StudyMeasure(flat(0), kNoMask);
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("black in all 64 pixels"));
    }
}

}  // namespace study_measure_test
}  // namespace lucerna
