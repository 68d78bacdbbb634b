// From radiance to display values: the tone curve, the exposure, the white.
#include "engine/colour/tone.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace tone_test {

constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = NAN, kHuge = 3e38F;

double least(const V3d& c) {
    return std::min({c.x, c.y, c.z});
}
double most(const V3d& c) {
    return std::max({c.x, c.y, c.z});
}

// Returns colours all around the hue circle, with a largest component of 1.
std::vector<V3d> hues() {
    std::vector<V3d> all;
    for (const double low : {0.0, 0.02, 0.4}) {
        for (const double middle : {0.0, 0.1, 0.5, 0.9, 1.0}) {
            const double m = std::min(low + middle * (1 - low), 1.0);
            for (const V3d& c : {V3d(1, m, low), V3d(m, 1, low), V3d(low, 1, m), V3d(low, m, 1),
                                 V3d(m, low, 1), V3d(1, low, m)})
                all.push_back(c);
        }
    }
    return all;
}

TEST(NeutralTone, UpToTheKnee_ChangesNothing) {
    for (const V3d& hue : hues()) {
        for (const double peak : {0.0, 1e-30, 0.001, 0.18, 0.5, 0.8})
            EXPECT_EQ(tone_mapped(peak * hue, ToneCurve::neutral), peak * hue);
        EXPECT_NE(tone_mapped(0.81 * hue, ToneCurve::neutral), 0.81 * hue);
    }
}

// Evaluates the formula of [Khronos 2024] by hand, with the knee at 0.8 and no offset.
TEST(NeutralTone, BrightColours_AreThePublishedCurves) {
    const auto expect = [](const V3d& in, const V3d& out) {
        EXPECT_NEAR((tone_mapped(in, ToneCurve::neutral) - out).length(), 0, 1e-6);
    };
    expect({2, 2, 2}, V3d(0.9714286));  // 1 - 0.04 / 1.4
    // For p = 2, q = 0.9714286, and 1 / (1 + 0.15 * 1.0285714) = 0.8663366 of the colour remains.
    expect({2, 1, 0.4}, {0.9714286, 0.5506365, 0.2981613});
}

TEST(NeutralTone, Greys_RiseWithoutAKinkAndStayBelowWhite) {
    double before = 0, slope = 1;
    for (int i = 1; i <= 4000; ++i) {
        const double grey = 0.002 * i;
        const V3d shown = tone_mapped(V3d(grey), ToneCurve::neutral);
        EXPECT_EQ(shown.x, shown.y);
        EXPECT_EQ(shown.x, shown.z);
        EXPECT_GT(shown.x, before);
        EXPECT_LT(shown.x, 1);
        const double here = (shown.x - before) / 0.002;
        EXPECT_NEAR(here, slope, 0.025) << "at " << grey;
        before = shown.x, slope = here;
    }
}

TEST(NeutralTone, AnyHue_IsKeptAndFadesToWhite) {
    for (const V3d& hue : hues()) {
        double saturation = most(hue) - least(hue) + 1e-12;
        for (const double peak : {0.5, 0.9, 1.5, 4.0, 30.0, 1e4}) {
            const V3d in = peak * hue, out = tone_mapped(in, ToneCurve::neutral);
            EXPECT_GE(least(out), 0);
            EXPECT_LE(most(out), 1);
            const double of = most(out) - least(out);
            EXPECT_LE(of / most(out), saturation + 1e-12);
            saturation = of / most(out);
            // The hue is the relative position of the middle component between the least and the largest one.
            for (int c = 0; c < 3; ++c) {
                EXPECT_NEAR(out[c] - least(out),
                            (in[c] - least(in)) * of / std::max(most(in) - least(in), 1e-12), 1e-9);
            }
        }
        EXPECT_LT(saturation, 0.001);
    }
}

TEST(LinearTone, Channels_AreClippedAtWhite) {
    EXPECT_EQ(tone_mapped({0.3, 0.99, 1}, ToneCurve::linear), V3d(0.3, 0.99, 1));
    EXPECT_EQ(tone_mapped({2, 0.5, 0}, ToneCurve::linear), V3d(1, 0.5, 0));
}

TEST(ToneCurves, Names_AreThoseOfTheCurves) {
    EXPECT_EQ(tone_curve_named("neutral"), ToneCurve::neutral);
    EXPECT_EQ(tone_curve_named("linear"), ToneCurve::linear);
    EXPECT_FALSE(tone_curve_named("filmic"));
    EXPECT_THAT(tone_curve_names(), ::testing::ElementsAre("neutral", "linear"));
}

TEST(Display, EncodesAsSrgb) {
    const Display display({2, ToneCurve::linear});
    const Rgb shown = display({0.09F, 0.001F, 7});
    EXPECT_NEAR(shown.x, 0.461356F, 1e-5F);  // 1.055 * 0.18^(1/2.4) - 0.055
    EXPECT_NEAR(shown.y, 0.02584F, 1e-6F);   // 12.92 * 0.002
    EXPECT_EQ(shown.z, 1);
}

// A colour outside the display's gamut is mixed with grey of its luminance, like one outside a colour space.
TEST(Display, ColourOutsideTheGamut_KeepsItsLuminance) {
    const Rgb outside(-0.1F, 0.5F, 0.1F);
    const Rgb shown = Display({})(outside);
    const auto decoded = [](float v) {
        return static_cast<float>(std::pow((double{v} + 0.055) / 1.055, 2.4));
    };
    EXPECT_EQ(shown.x, 0);
    EXPECT_NEAR(luminance({0, decoded(shown.y), decoded(shown.z)}), luminance(outside), 1e-5F);
}

TEST(Display, AnyNumbers_AreShownWithinRange) {
    const float values[] = {0, -0.0F, 1e-45F, 1, 1e19F, kHuge, kInfinity, -1, -kHuge, -kInfinity, kNan};
    for (const ToneCurve tone : {ToneCurve::neutral, ToneCurve::linear}) {
        for (const std::optional<double> white : {std::optional<double>(), std::optional(1000.0)}) {
            for (const float exposure : {1e-37F, 1.0F, 1e37F}) {
                for (const ColourSpace* space :
                     {static_cast<const ColourSpace*>(nullptr), find_colour_space("acescg")}) {
                    const Display display({exposure, tone, white}, space);
                    for (const float r : values) {
                        for (const float g : values) {
                            for (const float b : values) {
                                const Rgb shown = display({r, g, b});
                                for (const float v : {shown.x, shown.y, shown.z}) {
                                    ASSERT_GE(v, 0);
                                    ASSERT_LE(v, 1);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    EXPECT_EQ(Display({})(Rgb(kInfinity)), Rgb(1));
    EXPECT_EQ(Display({})(Rgb(kNan)), Rgb(0));
    EXPECT_EQ(Display({})(Rgb(kInfinity, 0.5F, 0.5F)), Rgb(1));
}

// Returns the published definitions of both loci, without white_balance().
V3d white_xyz(double kelvin) {
    const V3d xyz = emission_xyz(kelvin <= 4000 ? blackbody_spectrum(kelvin) : daylight_spectrum(kelvin));
    return xyz / xyz.y;
}
V3d unclamped_rgb(const V3d& xyz) {
    return colour_spaces().front().from_xyz(xyz);
}

TEST(WhiteBalance, WhiteOfThatTemperature_BecomesWhite) {
    for (const double kelvin : {1000.0, 1900.0, 2700.0, 3000.0, 4000.0, 5000.0, 6504.0, 9300.0, 25000.0}) {
        const V3d shown = white_balance(kelvin) * unclamped_rgb(white_xyz(kelvin));
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(shown[c], 1, 1e-5) << kelvin;
    }
    const V3d other = white_balance(4000) * unclamped_rgb(white_xyz(3000));
    EXPECT_GT(other.x, other.z + 0.2);
}

TEST(WhiteBalance, OfD65_ChangesNothing) {
    const RgbMatrix matrix = white_balance(6504);
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(matrix.rows[static_cast<std::size_t>(r)][c], r == c ? 1 : 0, 5e-4);
    }
}

TEST(WhiteBalance, BetweenTheLoci_HasNoStep) {
    for (const double at : {4000.0, 5000.0}) {
        const RgbMatrix below = white_balance(at - 0.01), above = white_balance(at + 0.01);
        for (std::size_t r = 0; r < 3; ++r) EXPECT_NEAR((below.rows[r] - above.rows[r]).length(), 0, 1e-4);
    }
}

}  // namespace tone_test
}  // namespace lucerna
