// An image under a picture's look: automatic exposure, white, and the contents of the file.
#include "engine/image/displayed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/spectrum.h"
#include "engine/image/pictures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace displayed_test {

constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = NAN, kHuge = 3e38F;

Image constant(float value, int width = 20, int height = 20) {
    Image image = Image::rgb(width, height);
    std::ranges::fill(image.data, value);
    return image;
}

// Returns greys spread evenly over `stops` stops around 1.
Image spread(double stops, std::uint32_t seed = 0) {
    Image image = Image::rgb(50, 40);
    Sampler sampler(71, Purpose::test, 0, seed);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const double stop = stops * (double{sampler.next()} - 0.5);
            image.set_rgb(x, y, Rgb(static_cast<float>(std::exp2(stop))));
        }
    }
    return image;
}

Image scaled(Image image, float factor) {
    for (float& value : image.data) value *= factor;
    return image;
}

TEST(AutoExposure, Constant_BecomesMiddleGrey) {
    for (const float value : {1e-30F, 0.01F, 1.0F, 7.0F, 1e30F})
        EXPECT_NEAR(auto_exposure(constant(value)) * value, 0.18F, 1e-6F);
    EXPECT_NEAR(auto_exposure(constant(7, 1, 1)) * 7, 0.18F, 1e-6F);
    Image wide = constant(0.5F);
    wide.space = find_colour_space("acescg");
    EXPECT_NEAR(auto_exposure(wide), 0.36F, 1e-6F);
}

TEST(AutoExposure, NoLight_IsOne) {
    EXPECT_EQ(auto_exposure(constant(0)), 1);
    EXPECT_EQ(auto_exposure(constant(-1)), 1);
    EXPECT_EQ(auto_exposure(constant(kNan)), 1);
    EXPECT_EQ(auto_exposure(constant(kInfinity)), 1);
}

TEST(AutoExposure, LeastAndLargestNumbers_HaveOneThatIsFinite) {
    for (const float value : {1e-45F, 1e-38F, kHuge}) {
        const float exposure = auto_exposure(constant(value));
        EXPECT_TRUE(std::isfinite(exposure));
        EXPECT_GT(exposure, 0);
    }
}

TEST(AutoExposure, TimesTheLight_IsOneOverIt) {
    for (const double stops : {1.0, 6.0, 20.0}) {
        const Image image = spread(stops);
        const float once = auto_exposure(image);
        for (const float factor : {1e-20F, 0.3F, 17.0F, 1e20F})
            EXPECT_NEAR(auto_exposure(scaled(image, factor)) * factor / once, 1, 1e-5);
    }
}

// Computes the expected value independently, by sorting and bisection.
TEST(AutoExposure, MeanOfWhatIsShown_IsMiddleGrey) {
    for (const double stops : {0.5, 4.0, 11.0}) {  // within the range that is not black
        const Image image = spread(stops);
        std::vector<float> values;
        for (std::size_t i = 0; i < image.data.size(); i += 3) values.push_back(image.data[i]);
        std::ranges::sort(values);
        values.resize(values.size() * 95 / 100);
        double low = 0, high = 1e9;
        for (int i = 0; i < 200; ++i) {
            const double middle = 0.5 * (low + high);
            double sum = 0;
            for (const float value : values) sum += std::min(1.0, middle * double{value});
            (sum < 0.18 * static_cast<double>(values.size()) ? low : high) = middle;
        }
        EXPECT_NEAR(double{auto_exposure(image)} / low, 1, 1e-5) << stops;
    }
}

TEST(AutoExposure, AnyImage_HasAtMostTwentyTwoHundredthsBeyondWhite) {
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        const Image image = spread(2.0 * seed, seed);
        const float exposure = auto_exposure(image);
        std::size_t beyond = 0;
        for (std::size_t i = 0; i < image.data.size(); i += 3) beyond += image.data[i] * exposure > 1;
        EXPECT_LE(static_cast<double>(3 * beyond) / static_cast<double>(image.data.size()), 0.222) << seed;
    }
}

TEST(AutoExposure, Firefly_ChangesNothing) {
    Image image = constant(1);
    const float before = auto_exposure(image);
    image.set_rgb(7, 3, Rgb(1e30F));
    EXPECT_EQ(auto_exposure(image), before);

    image = spread(6);
    const float of_spread = auto_exposure(image);
    image.set_rgb(7, 3, Rgb(1e30F));
    EXPECT_NEAR(auto_exposure(image) / of_spread, 1, 0.002);
}

TEST(AutoExposure, LampThatIsSeen_ChangesNothing) {
    Image image = constant(1);
    const float before = auto_exposure(image);
    for (int x = 0; x < 16; ++x) image.set_rgb(x, 0, Rgb(500));  // 4 % of the pixels
    EXPECT_EQ(auto_exposure(image), before);
}

// The exposure must not depend on whether the surroundings are black or merely shown as black by any display.
TEST(AutoExposure, SpotOnBlack_IsExposedForTheSpot) {
    for (const float around : {0.0F, 1e-8F, 2e-4F}) {
        Image image = constant(around);
        for (int i = 0; i < 12; ++i) image.set_rgb(i % 4, i / 4, Rgb(5));  // 3 % of the pixels
        EXPECT_NEAR(auto_exposure(image) * 5, 0.18F, 1e-5F) << around;
    }
    // If the surroundings are dim but visible, they are the subject, and the spot is a lamp.
    Image image = constant(0.01F);
    for (int i = 0; i < 12; ++i) image.set_rgb(i % 4, i / 4, Rgb(5));
    EXPECT_NEAR(auto_exposure(image) * 0.01F, 0.18F, 1e-5F);
}

TEST(WhiteBalance, LightOfThatTemperature_IsGreyInThePicture) {
    const testing::TemporaryFolder folder;
    const V3d xyz = emission_xyz(blackbody_spectrum(3000)), warm = xyz / xyz.y;
    for (const ColourSpace* space : {static_cast<const ColourSpace*>(nullptr), find_colour_space("acescg")}) {
        Image image = Image::rgb(2, 1);
        image.space = space;
        image.set_rgb(
            0, 0, Rgb(V3f(0.18 * (space ? space->from_xyz(warm) : colour_spaces().front().from_xyz(warm)))));
        image.set_rgb(1, 0, Rgb(0.18F));
        PictureLook look;
        look.white = 3000;
        write_png(folder / "a.png", image, look);
        const auto in = pictures(folder / "a.png").open(folder / "a.png", PictureUse::measurement);
        std::vector<std::uint8_t> bytes(6);
        in->read({0, 3}, std::span(bytes));
        EXPECT_THAT(bytes, ::testing::ElementsAre(118, 118, 118, ::testing::Lt(100), ::testing::_,
                                                  ::testing::Gt(150)));
    }
}

}  // namespace displayed_test
}  // namespace lucerna
