#include "engine/evaluation/seeds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "engine/base/error.h"
#include "engine/base/stats.h"

namespace lucerna {
namespace seeds_test {

// A scene of one grey, rendered with noise and a uniform `bias`.
struct Shot {
    double truth = 1, bias = 0, sigma = 0.1;
    int size = 12;
    bool variance = true;
};

Image taken(const Shot& shot, std::mt19937_64& generator) {
    Image image(shot.size, shot.size, {"R", "variance.R"});
    if (!shot.variance) image = Image(shot.size, shot.size, {"R"});
    std::normal_distribution<double> noise(shot.truth + shot.bias, shot.sigma);
    for (int y = 0; y < shot.size; ++y) {
        for (int x = 0; x < shot.size; ++x) {
            image.value(x, y, 0) =
                static_cast<float>(shot.sigma > 0 ? noise(generator) : shot.truth + shot.bias);
            if (shot.variance) image.value(x, y, 1) = static_cast<float>(shot.sigma * shot.sigma);
        }
    }
    return image;
}

std::vector<NamedImage> seeds_of(const Shot& shot, int count, std::mt19937_64& generator) {
    std::vector<NamedImage> images;
    for (int i = 0; i < count; ++i) images.push_back({"seed" + std::to_string(i), taken(shot, generator)});
    return images;
}

TEST(Seeds, TwoPixelsTwoSeeds_EqualsHandNumbers) {
    Image a(2, 1, {"Y"}), b(2, 1, {"Y"}), r(2, 1, {"Y"});
    a.data = {1, 5};
    b.data = {3, 6};
    r.data = {1, 4};
    const std::vector<NamedImage> images{{"a", a}, {"b", b}};
    const BiasAndNoise found = bias_and_noise(images, {"r", r});
    EXPECT_NEAR(found.absolute.mse.value, ((0 + 1) / 2.0 + (4 + 4) / 2.0) / 2, 1e-12);
    EXPECT_NEAR(found.absolute.bias2.value, (0 * 2 + 1 * 2) / 2.0, 1e-12);
    EXPECT_NEAR(found.absolute.noise2.value, (2 + 0.5) / 2, 1e-12);  // sample variances 2 and 1/2
    EXPECT_NEAR(found.relative.bias2.value, (0 * 2 / 1.0001 + 1 * 2 / 16.0001) / 2, 1e-12);
    EXPECT_FALSE(found.absolute.bias2.error);
    EXPECT_TRUE(found.absolute.mse.error);
    EXPECT_NEAR(found.channels[0].mean.value, 3.75, 1e-12);
    EXPECT_NEAR(found.channels[0].ratio->value, 3.75 / 2.5, 1e-12);
    EXPECT_NEAR(*found.channels[0].mean.error, 0.75, 1e-12);  // means 3 and 4.5
    EXPECT_FALSE(found.stated_over_actual);
}

TEST(Seeds, OverManyRuns_BiasAndNoiseComeOutRight) {
    std::mt19937_64 generator(2101);
    const Shot shot{1, 0.03, 0.1, 12, true}, reference{1, 0, 0.05, 12, true};
    RunningStats bias, noise, stated_error2, ratio;
    for (int run = 0; run < 400; ++run) {
        const auto images = seeds_of(shot, 5, generator);
        const BiasAndNoise found = bias_and_noise(images, {"reference", taken(reference, generator)});
        bias.add(found.absolute.bias2.value);
        noise.add(found.absolute.noise2.value);
        stated_error2.add(*found.absolute.bias2.error * *found.absolute.bias2.error);
        ratio.add(*found.stated_over_actual);
    }
    EXPECT_NEAR(bias.mean(), 0.03 * 0.03, 4 * bias.standard_error());
    EXPECT_NEAR(noise.mean(), 0.01, 4 * noise.standard_error());
    EXPECT_NEAR(ratio.mean(), 1, 0.02);
    // The stated standard error is that of the estimate, or slightly larger.
    EXPECT_GT(stated_error2.mean(), 0.9 * bias.variance());
    EXPECT_LT(stated_error2.mean(), 2.5 * bias.variance());
    // The test would detect noise of the mean or of the reference that is not subtracted.
    EXPECT_GT(0.0009 + 0.01 / 5, bias.mean() + 10 * bias.standard_error());
    EXPECT_GT(0.0009 + 0.0025, bias.mean() + 10 * bias.standard_error());
}

TEST(Seeds, WithoutBias_TheSquareIsAsOftenBelowZeroAsNotAndWithinItsError) {
    std::mt19937_64 generator(2102);
    int below = 0, within = 0;
    constexpr int kRuns = 300;
    for (int run = 0; run < kRuns; ++run) {
        const auto images = seeds_of({}, 4, generator);
        const BiasAndNoise found =
            bias_and_noise(images, {"reference", taken({1, 0, 0, 12, true}, generator)});
        below += found.absolute.bias2.value < 0;
        within += std::fabs(found.absolute.bias2.value) <= 2 * *found.absolute.bias2.error;
    }
    EXPECT_GT(below, kRuns / 3);
    EXPECT_LT(below, kRuns * 2 / 3);
    EXPECT_GT(within, kRuns * 85 / 100);
}

TEST(Seeds, NoiseThatHangsTogether_IsInTheErrorAllTheSame) {
    // Each seed is too bright or too dark as a whole, as with few photons, so the pixels are fully
    // correlated.
    std::mt19937_64 generator(2103);
    std::normal_distribution<double> whole(0, 0.1);
    RunningStats bias, stated_error2;
    for (int run = 0; run < 400; ++run) {
        std::vector<NamedImage> images;
        for (int i = 0; i < 6; ++i)
            images.push_back({"seed", taken({1, 0.2 + whole(generator), 0.01, 6, false}, generator)});
        const BiasAndNoise found =
            bias_and_noise(images, {"reference", taken({1, 0, 0, 6, false}, generator)});
        bias.add(found.absolute.bias2.value);
        stated_error2.add(*found.absolute.bias2.error * *found.absolute.bias2.error);
    }
    EXPECT_NEAR(bias.mean(), 0.04, 4 * bias.standard_error());
    EXPECT_GT(stated_error2.mean(), 0.8 * bias.variance());
    EXPECT_LT(stated_error2.mean(), 1.6 * bias.variance());
}

TEST(Seeds, VarianceThatIsStatedTooSmall_Shows) {
    std::mt19937_64 generator(2104);
    auto images = seeds_of({}, 4, generator);
    for (NamedImage& one : images) {
        for (std::size_t i = 1; i < one.image.data.size(); i += 2) one.image.data[i] /= 4;
    }
    const BiasAndNoise found = bias_and_noise(images, {"reference", taken({}, generator)});
    EXPECT_NEAR(*found.stated_over_actual, 0.25, 0.05);
}

TEST(Seeds, EqualImages_AreCounted) {
    std::mt19937_64 generator(2105);
    auto images = seeds_of({}, 3, generator);
    images[2].image = images[0].image;
    EXPECT_EQ(bias_and_noise(images, {"reference", taken({}, generator)}).equal_pairs, 1U);
}

TEST(Seeds, PixelsThatOneSeedLacks_AreLeftOutForAll) {
    std::mt19937_64 generator(2106);
    auto images = seeds_of({}, 3, generator);
    images[1].image.value(2, 3, 0) = NAN;
    const BiasAndNoise found = bias_and_noise(images, {"reference", taken({}, generator)});
    EXPECT_EQ(found.pixels, 143U);
    EXPECT_TRUE(std::isfinite(found.absolute.mse.value));
}

TEST(Seeds, MeanImage_HasTheVarianceOfAMean) {
    Image a(1, 1, {"R", "variance.R"}), b(1, 1, {"variance.R", "R"});
    a.data = {1, 0.5F};
    b.data = {0.3F, 2};
    const std::vector<NamedImage> images{{"a", a}, {"b", b}};
    const Image mean = mean_image(images);
    EXPECT_FLOAT_EQ(mean.data[0], 1.5F);
    EXPECT_FLOAT_EQ(mean.data[1], 0.2F);
    EXPECT_FLOAT_EQ(noise_image(images).data[0], std::sqrt(0.5F));
}

TEST(Seeds, UnfitImages_AreRefusedByName) {
    const NamedImage small{"small.exr", Image(1, 1, {"R"})}, wide{"wide.exr", Image(2, 1, {"R"})},
        other{"other.exr", Image(1, 1, {"R", "G"})}, rg{"rg.exr", Image(1, 1, {"R", "G"})};
    const auto message = [](const std::vector<NamedImage>& images, const NamedImage& reference) {
        try {
            bias_and_noise(images, reference);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    EXPECT_NE(message({small, wide}, small).find("wide.exr"), std::string::npos);
    EXPECT_NE(message({small, other}, rg).find("other.exr"), std::string::npos);
    EXPECT_NE(message({small}, small).find("two images"), std::string::npos);
    EXPECT_THROW(mean_image(std::vector<NamedImage>{small, wide}), InputError);
    EXPECT_THROW(mean_image(std::vector<NamedImage>{rg, small}), InputError);
}

}  // namespace seeds_test
}  // namespace lucerna
