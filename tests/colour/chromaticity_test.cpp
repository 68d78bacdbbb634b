#include "engine/colour/chromaticity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace chromaticity_test {

V3d of_xy(double x, double y) {
    return {x / y, 1, (1 - x - y) / y};
}

// Converts from CIE 1960 u, v.
V3d of_uv(double u, double v) {
    const double below = 2 * u - 8 * v + 4;
    return of_xy(3 * u / below, 2 * v / below);
}

TEST(Chromaticity, OfKnownColours_IsThePublishedOne) {
    const Chromaticity d65 = chromaticity(kWhiteXyz);
    EXPECT_NEAR(d65.x, 0.3127, 5e-5);
    EXPECT_NEAR(d65.y, 0.3290, 5e-5);
    EXPECT_NEAR(d65.u, 0.1978, 5e-5);
    EXPECT_NEAR(d65.v, 0.4683, 5e-5);
    const Chromaticity a = chromaticity(7.0 * of_xy(0.44758, 0.40745));
    EXPECT_NEAR(a.x, 0.44758, 1e-12);
    EXPECT_NEAR(a.u, 0.2560, 5e-5);
    EXPECT_NEAR(a.v, 0.5243, 5e-5);
}

TEST(ColourTemperature, OfBlackBodies_IsTheirOwn) {
    for (const double kelvin : {1100.0, 1500.0, 2000.0, 2856.0, 4000.0, 6504.0, 10000.0, 25000.0, 100000.0}) {
        const auto t = colour_temperature(spectrum_to_xyz(blackbody_spectrum(kelvin)));
        ASSERT_TRUE(t) << kelvin;
        EXPECT_NEAR(t->kelvin / kelvin, 1, 1e-6 * std::max(1.0, kelvin / 1000)) << kelvin;
        EXPECT_NEAR(t->duv, 0, 1e-7) << kelvin;
    }
}

// Chromaticities and correlated colour temperatures of CIE 15:2004, tables T.3 and T.8, to ten kelvins for
// the F series. The fifth digit of daylight's chromaticity is worth 2 K at 6500 K, the fourth digit of F7's
// about 20 K.
TEST(ColourTemperature, OfTheCiesIlluminants_IsThePublishedOne) {
    const auto a = colour_temperature(of_xy(0.44758, 0.40745));
    ASSERT_TRUE(a);
    EXPECT_NEAR(a->kelvin, 2856, 1);
    EXPECT_NEAR(a->duv, 0, 5e-5);
    const auto d65 = colour_temperature(of_xy(0.31272, 0.32903));
    ASSERT_TRUE(d65);
    EXPECT_NEAR(d65->kelvin, 6504, 2);
    EXPECT_NEAR(d65->duv, 0.0032, 5e-5);
    const auto d50 = colour_temperature(of_xy(0.34567, 0.35851));
    ASSERT_TRUE(d50);
    EXPECT_NEAR(d50->kelvin, 5003, 2);
    const double published[] = {6430, 4230, 3450, 2940, 6350, 4150, 6500, 5000, 4150, 5000, 4000, 3000};
    const double xy[12][2] = {{0.3131, 0.3371}, {0.3721, 0.3751}, {0.4091, 0.3941}, {0.4402, 0.4031},
                              {0.3138, 0.3452}, {0.3779, 0.3882}, {0.3129, 0.3292}, {0.3458, 0.3586},
                              {0.3741, 0.3727}, {0.3458, 0.3588}, {0.3805, 0.3769}, {0.4370, 0.4042}};
    for (int i = 0; i < 12; ++i) {
        const auto t = colour_temperature(of_xy(xy[i][0], xy[i][1]));
        ASSERT_TRUE(t);
        EXPECT_NEAR(t->kelvin, published[i], 10) << "F" << i + 1;
    }
}

// Colours beside the locus are made by stepping off it along its normal; they must have the temperature and
// the distance that they are made with.
TEST(ColourTemperature, BesideTheLocus_FindsTheFootAndTheDistance) {
    const auto uv = [](double kelvin) {
        const Chromaticity c = chromaticity(spectrum_to_xyz(blackbody_spectrum(kelvin)));
        return std::pair(c.u, c.v * 2 / 3);
    };
    for (const double kelvin : {1500.0, 2700.0, 4000.0, 6500.0, 15000.0}) {
        const auto [u, v] = uv(kelvin);
        const auto [u1, v1] = uv(kelvin * (1 - 1e-4));
        const auto [u2, v2] = uv(kelvin * (1 + 1e-4));
        const double du = u1 - u2, dv = v1 - v2, length = std::hypot(du, dv);
        for (const double duv : {-0.045, -0.02, -0.001, 0.001, 0.02, 0.045}) {
            const auto t = colour_temperature(of_uv(u - dv / length * duv, v + du / length * duv));
            ASSERT_TRUE(t) << kelvin << ' ' << duv;
            EXPECT_NEAR(t->kelvin / kelvin, 1, 1e-4) << kelvin << ' ' << duv;
            EXPECT_NEAR(t->duv, duv, 1e-7) << kelvin << ' ' << duv;
        }
        for (const double duv : {-0.055, 0.055}) {
            EXPECT_FALSE(colour_temperature(of_uv(u - dv / length * duv, v + du / length * duv)))
                << kelvin << ' ' << duv;
        }
    }
}

TEST(ColourTemperature, OfWhatResemblesNoBlackBody_IsNone) {
    EXPECT_FALSE(colour_temperature(cie_xyz(530)));
    EXPECT_FALSE(colour_temperature(cie_xyz(450)));
    EXPECT_FALSE(colour_temperature(spectrum_to_xyz(blackbody_spectrum(900))));
    EXPECT_FALSE(colour_temperature(V3d(0, 0, 0)));
    EXPECT_FALSE(colour_temperature(V3d(std::numeric_limits<double>::quiet_NaN())));
    EXPECT_FALSE(colour_temperature(V3d(std::numeric_limits<double>::infinity())));
}

}  // namespace chromaticity_test
}  // namespace lucerna
