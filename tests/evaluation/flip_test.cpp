#include "engine/evaluation/flip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lucerna {
namespace flip_test {

constexpr double kPpd = kUsualPixelsPerDegree;

Image constant(const Rgb& c, int width = 24, int height = 16) {
    Image image = Image::rgb(width, height);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) image.set_rgb(x, y, c);
    }
    return image;
}

// Returns a structured picture: smooth noise between `low` and `high`.
Image noise(unsigned seed, float low, float high, int width = 40, int height = 30) {
    Image image = Image::rgb(width, height);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<float> value(low, high);
    for (float& v : image.data) v = value(generator);
    return image;
}

double mean_of(const Image& map) {
    double sum = 0;
    for (const float v : map.data) sum += double{v};
    return sum / static_cast<double>(map.data.size());
}

// Returns FLIP between two constant greys, which differ only in lightness. The largest colour distance is
// that of green (87.7347, -86.1827, 83.1793) and blue (32.2970, 79.1875, -107.8602) in L*a*b*, after Hunt's
// adjustment (…, -75.612, 72.977) and (…, 25.575, -34.836): 55.438 + hypot(101.187, 107.813) = 203.297.
double grey_flip(double lightness_difference) {
    const double error = std::pow(lightness_difference, 0.7), most = std::pow(203.297, 0.7),
                 knee = 0.4 * most;
    return error < knee ? 0.95 * error / knee : 0.95 + 0.05 * (error - knee) / (most - knee);
}

TEST(Flip, ScreenOfThePaper_HasItsPixelsPerDegree) {
    EXPECT_NEAR(pixels_per_degree(0.7, 0.7, 3840), kPpd, 1e-9);
}

TEST(Flip, PictureWithItself_IsNothing) {
    const Image picture = noise(1, 0, 1);
    const Image map = flip(picture, picture, kPpd);
    for (const float v : map.data) EXPECT_EQ(v, 0);
}

TEST(Flip, BlackAndWhite_EqualsHandNumber) {
    const Image map = flip(constant(Rgb(1)), constant(Rgb(0)), kPpd);
    for (const float v : map.data) EXPECT_NEAR(double{v}, grey_flip(100), 1e-4);
    EXPECT_NEAR(grey_flip(100), 0.967, 0.001);
}

TEST(Flip, TwoGreys_EqualsHandNumber) {
    // sRGB 0.5 is 0.214041 linear: L* = 116 · 0.214041^(1/3) - 16 = 53.389; 0.6 is 0.318547: 63.223.
    const Image map = flip(constant(Rgb(0.5F)), constant(Rgb(0.6F)), kPpd);
    for (const float v : map.data) EXPECT_NEAR(double{v}, grey_flip(63.2233 - 53.3890), 1e-4);
}

TEST(Flip, GreenAndBlue_AreTheMost) {
    for (const float v : flip(constant(Rgb(0, 1, 0)), constant(Rgb(0, 0, 1)), kPpd).data)
        EXPECT_NEAR(double{v}, 1, 1e-4);
}

TEST(Flip, AnyTwoPictures_AreSymmetricAndInRange) {
    for (unsigned seed = 1; seed < 6; ++seed) {
        const Image a = noise(seed, -0.5F, 1.5F), b = noise(seed + 100, 0, 1);
        const Image there = flip(a, b, kPpd), back = flip(b, a, kPpd);
        EXPECT_EQ(there.data, back.data);
        for (const float v : there.data) {
            EXPECT_GE(v, 0);
            EXPECT_LE(v, 1);
        }
        EXPECT_GT(mean_of(there), 0.1);
    }
}

TEST(Flip, FinePattern_IsSeenLessFromFurtherAway) {
    Image pattern = constant(Rgb(0.5F), 64, 64);
    for (int y = 0; y < 64; ++y) {
        for (int x = 0; x < 64; ++x) pattern.set_rgb(x, y, Rgb((x + y) % 2 == 0 ? 0.45F : 0.55F));
    }
    double before = 1;
    for (const double ppd : {10.0, 20.0, 40.0, 80.0}) {
        const double error = mean_of(flip(pattern, constant(Rgb(0.5F), 64, 64), ppd));
        EXPECT_LT(error, before) << ppd;
        before = error;
    }
}

TEST(Flip, LargerDifference_IsLargerError) {
    const Image reference = noise(7, 0.3F, 0.5F);
    double before = 0;
    for (const float shift : {0.02F, 0.05F, 0.1F, 0.2F, 0.4F}) {
        Image picture = reference;
        for (float& v : picture.data) v += shift;
        const double error = mean_of(flip(picture, reference, kPpd));
        EXPECT_GT(error, before) << shift;
        before = error;
    }
}

TEST(Flip, AnEdgeThatIsNotThere_CountsForMoreThanItsColours) {
    // At a step of lightness by 10 the features differ; far away only the colours do.
    Image step = constant(Rgb(0.5F), 120, 16);
    for (int y = 0; y < 16; ++y) {
        for (int x = 60; x < 120; ++x) step.set_rgb(x, y, Rgb(0.6F));
    }
    const Image map = flip(step, constant(Rgb(0.5F), 120, 16), kPpd);
    EXPECT_NEAR(double{map.value(110, 8, 0)}, grey_flip(63.2233 - 53.3890), 1e-3);
    EXPECT_GT(map.value(61, 8, 0), map.value(110, 8, 0) * 1.05F);
    EXPECT_LT(map.value(5, 8, 0), 1e-3F);
}

TEST(Flip, BesideAStep_EqualsHandNumber) {
    // The linear luminance steps from 0.214041 to 0.318547 at the first brighter pixel. The derivative's
    // positive weights sum to 1, so the edge is as strong as the step is high; blurred, the luminance there
    // is that of the Gaussian's half including its centre.
    const double low = 0.214041, step = 0.318547 - 0.214041;
    double half = 0, whole = 0;
    for (int k = -10; k <= 10; ++k) {
        const double weight = std::exp(-std::pow(kPiD * k / kPpd, 2) / 0.0047);
        whole += weight;
        if (k >= 0) half += weight;
    }
    const auto lightness = [](double y) { return 116 * std::cbrt(y) - 16; };
    const double colour = grey_flip(lightness(low + step * half / whole) - lightness(low));
    const double expected = std::pow(colour, 1 - std::sqrt(step / std::sqrt(2.0)));
    Image image = constant(Rgb(0.5F), 120, 16);
    for (int y = 0; y < 16; ++y) {
        for (int x = 60; x < 120; ++x) image.set_rgb(x, y, Rgb(0.6F));
    }
    EXPECT_NEAR(double{flip(image, constant(Rgb(0.5F), 120, 16), kPpd).value(60, 8, 0)}, expected, 2e-4);
}

TEST(Flip, ThreadsAndTinyPictures_ChangeNothing) {
    const Image a = noise(3, 0, 1, 70, 90), b = noise(4, 0, 1, 70, 90);
    EXPECT_EQ(flip(a, b, kPpd, {1}).data, flip(a, b, kPpd, {4}).data);
    EXPECT_NEAR(double{flip(constant(Rgb(1), 1, 1), constant(Rgb(0), 1, 1), kPpd).data[0]}, grey_flip(100),
                1e-4);
    EXPECT_TRUE(std::isfinite(flip(noise(1, 0, 1, 3, 2), noise(2, 0, 1, 3, 2), 0.5).data[0]));
}

TEST(FlipFilters, Blurs_KeepConstantsAndAreAsWideAsThePaperSays) {
    const EyeBlurs eye = eye_blurs(kPpd);
    for (const Blur* blur : {&eye.achromatic, &eye.red_green, &eye.blue_yellow}) {
        double whole = 0;
        for (const Blur::Part& part : blur->parts) {
            double sum = 0;
            for (const float w : part.kernel) sum += double{w};
            EXPECT_NEAR(sum, 1, 1e-6);
            EXPECT_EQ(part.kernel.size(), 21U);  // 3 · sqrt(0.04 / 2π²) · 67 = 9.05 pixels to either side
            whole += double{part.weight};
        }
        EXPECT_NEAR(whole, 1, 1e-6);
    }
    // The variance of exp(-π² x² / b) is b / 2π².
    double variance = 0;
    for (int x = -10; x <= 10; ++x)
        variance += x * x * double{eye.achromatic.parts[0].kernel[static_cast<std::size_t>(x + 10)]};
    EXPECT_NEAR(variance, 0.0047 / (2 * kPiD * kPiD) * kPpd * kPpd, 1e-3);
}

TEST(FlipFilters, Derivatives_SeeStepsAndNothingInConstants) {
    const FeatureKernels kernels = feature_kernels(kPpd);
    for (const Kernel* kernel : {&kernels.edge, &kernels.point}) {
        double positive = 0, negative = 0;
        for (const float w : *kernel) (w > 0 ? positive : negative) += double{w};
        EXPECT_NEAR(positive, 1, 1e-6);
        EXPECT_NEAR(negative, -1, 1e-6);
    }
}

// --- HDR ---

TEST(HdrFlip, ExposuresOfAConstant_BringItTo85PercentOfWhite) {
    const auto range = flip_exposures(constant(Rgb(3)));
    ASSERT_TRUE(range);
    EXPECT_EQ(range->count, 2);
    EXPECT_NEAR(range->start, range->stop, 1e-12);
    const double x = 3 * std::exp2(range->start) * 0.6;  // Narkowicz's curve sees 0.6 of the value
    EXPECT_NEAR(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.85, 1e-6);
}

TEST(HdrFlip, Exposures_SpanFromTheBrightestToTheMedian) {
    Image image = constant(Rgb(1), 10, 10);
    image.set_rgb(3, 3, Rgb(1000));
    for (int x = 0; x < 10; ++x) image.set_rgb(x, 9, Rgb(0));  // unlit pixels do not count for the median
    const auto range = flip_exposures(image);
    ASSERT_TRUE(range);
    EXPECT_NEAR(range->stop - range->start, std::log2(1000.0), 1e-6);
    EXPECT_EQ(range->count, 10);  // ceil(9.97)
    EXPECT_FALSE(flip_exposures(constant(Rgb(0))));
}

TEST(HdrFlip, ConstantImages_EqualHandNumbers) {
    const Image reference = constant(Rgb(2)), image = constant(Rgb(1));
    Monitor quiet;
    const auto range = flip_exposures(reference);
    const HdrFlip result = hdr_flip(image, reference, *range, kPpd, {}, quiet);
    // The reference is shown at 0.85, and the image at the curve's value for half of the corresponding input.
    const auto curve = [](double x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); };
    double x = 1;
    for (int i = 0; i < 200; ++i) x *= 1 + 0.5 * (0.85 - curve(x));  // converges to curve(x) = 0.85
    const auto lightness = [](double y) { return 116 * std::cbrt(y) - 16; };
    const double expected = grey_flip(lightness(0.85) - lightness(curve(x / 2)));
    for (const float v : result.map.data) EXPECT_NEAR(double{v}, expected, 1e-4);
}

TEST(HdrFlip, IsTheLargestOverExposuresAndDoesNotKnowTheUnit) {
    const Image reference = noise(11, 0.1F, 1), image = noise(12, 0.1F, 1);
    Image bright = reference, bright_image = image;
    for (float& v : bright.data) v *= 4096;
    for (float& v : bright_image.data) v *= 4096;
    Monitor quiet;
    const auto range = flip_exposures(reference), bright_range = flip_exposures(bright);
    EXPECT_EQ(range->count, bright_range->count);
    const HdrFlip a = hdr_flip(image, reference, *range, kPpd, {}, quiet);
    const HdrFlip b = hdr_flip(bright_image, bright, *bright_range, kPpd, {}, quiet);
    for (std::size_t i = 0; i < a.map.data.size(); ++i) EXPECT_NEAR(a.map.data[i], b.map.data[i], 1e-4F);
    const ExposureRange one{range->stop, range->stop, 2};
    const HdrFlip alone = hdr_flip(image, reference, one, kPpd, {}, quiet);
    for (std::size_t i = 0; i < a.map.data.size(); ++i) EXPECT_GE(a.map.data[i], alone.map.data[i]);
}

TEST(HdrFlip, HugeAndTinyValues_StayInRange) {
    Image reference = constant(Rgb(1e-30F)), image = constant(Rgb(1e30F));
    reference.set_rgb(1, 1, Rgb(1e30F));
    Monitor quiet;
    const auto range = flip_exposures(reference);
    ASSERT_TRUE(range);
    const ExposureRange few{range->start, range->stop, 3};
    for (const float v : hdr_flip(image, reference, few, kPpd, {}, quiet).map.data) {
        EXPECT_GE(v, 0);
        EXPECT_LE(v, 1);
    }
}

}  // namespace flip_test
}  // namespace lucerna
