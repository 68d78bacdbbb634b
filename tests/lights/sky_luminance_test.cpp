#include "lights/sky_luminance.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lucerna {
namespace sky_luminance_test {

V3d direction(double zenith_degrees, double azimuth_degrees) {
    const double z = zenith_degrees * kPiD / 180, a = azimuth_degrees * kPiD / 180;
    return {std::sin(z) * std::sin(a), std::sin(z) * std::cos(a), std::cos(z)};
}

struct CieRow {
    double a, b, c, d, e;
};
// ISO 15469:2004, Table 1, by types.
constexpr CieRow kTable[] = {
    {4, -0.7, 0, -1, 0},        {4, -0.7, 2, -1.5, 0.15},  {1.1, -0.8, 0, -1, 0},
    {1.1, -0.8, 2, -1.5, 0.15}, {0, -1, 0, -1, 0},         {0, -1, 2, -1.5, 0.15},
    {0, -1, 5, -2.5, 0.3},      {0, -1, 10, -3, 0.45},     {-1, -0.55, 2, -1.5, 0.15},
    {-1, -0.55, 5, -2.5, 0.3},  {-1, -0.55, 10, -3, 0.45}, {-1, -0.32, 10, -3, 0.45},
    {-1, -0.32, 16, -3, 0.3},   {-1, -0.15, 16, -3, 0.3},  {-1, -0.15, 24, -2.8, 0.15}};

// Returns the luminance over that of the zenith, by the standard's own quotient of gradations and
// indicatrices (its equations 1 to 4), of angles.
double by_standard(const CieRow& row, double zenith, double azimuth, double sun_zenith) {
    const double z = zenith * kPiD / 180, zs = sun_zenith * kPiD / 180, az = azimuth * kPiD / 180;
    const double chi = std::acos(
        std::clamp(std::cos(zs) * std::cos(z) + std::sin(zs) * std::sin(z) * std::cos(az), -1.0, 1.0));
    const auto phi = [&](double angle) { return 1 + row.a * std::exp(row.b / std::cos(angle)); };
    const auto f = [&](double angle) {
        return 1 + row.c * (std::exp(row.d * angle) - std::exp(row.d * kPiD / 2)) +
               row.e * std::cos(angle) * std::cos(angle);
    };
    return f(chi) * phi(z) / (f(zs) * phi(0));
}

// Returns the largest relative difference of a type's luminances from those of a row.
double worst_difference(int type, const CieRow& row) {
    const SkyModel model = cie_sky(type).value();
    double worst = 0;
    for (const double sun_zenith : {0.0, 20.0, 60.0, 85.0}) {
        const V3d sun = direction(sun_zenith, 0);
        const double zenith = model.relative_luminance({0, 0, 1}, sun);
        for (double z = 0; z < 90; z += 4.5) {
            for (double azimuth = 0; azimuth < 360; azimuth += 15) {
                const double truth = by_standard(row, z, azimuth, sun_zenith);
                const double found = model.relative_luminance(direction(z, azimuth), sun) / zenith;
                worst = std::max(worst, std::fabs(found / truth - 1));
            }
        }
    }
    return worst;
}

TEST(CieSky, EveryType_FollowsTheStandard) {
    for (int type = 1; type <= 15; ++type) {
        EXPECT_LT(worst_difference(type, kTable[type - 1]), 1e-7) << type;
        for (int other = 1; other <= 15; ++other) {
            if (other == type) continue;
            EXPECT_GT(worst_difference(type, kTable[other - 1]), 0.01) << type << " taken for " << other;
        }
    }
}

TEST(CieSky, TraditionalOvercast_IsThreeTimesAsBrightAtTheZenithAsAtTheHorizon) {
    const SkyModel sky = cie_sky(16).value();
    EXPECT_FALSE(sky.has_sun());
    EXPECT_DOUBLE_EQ(sky.relative_luminance({0, 0, 1}, {0, 0, 1}), 1);
    EXPECT_DOUBLE_EQ(sky.relative_luminance({1, 0, 0}, {0, 0, 1}), 1.0 / 3);
    EXPECT_DOUBLE_EQ(sky.relative_luminance(direction(60, 77), {0, 0, 1}), 2.0 / 3);
}

TEST(CieSky, OtherNumbers_AreNoTypes) {
    for (const int type : {-1, 0, 17}) EXPECT_FALSE(cie_sky(type)) << type;
}

TEST(CieSky, SunMatters_ToTypesWithAnIndicatrix) {
    for (int type = 1; type <= 15; ++type)
        EXPECT_EQ(cie_sky(type)->has_sun(), kTable[type - 1].c != 0) << type;
}

TEST(CieSky, BelowTheHorizon_IsDark) {
    EXPECT_EQ(cie_sky(12)->relative_luminance(direction(95, 10), direction(30, 0)), 0);
    EXPECT_TRUE(std::isfinite(cie_sky(1)->relative_luminance({1, 0, 0}, direction(30, 0))));
}

// One weather, and what another implementation of the model computes for it: Radiance's gendaymtx 2.5, in
// which the precipitable water is 2 cm. The luminances are those of the zenith, and of points 60° from it
// below the sun, 60° from it a quarter turn beside the sun, and 30° from it opposite the sun.
struct Weather {
    double elevation, direct, diffuse;
    double diffuse_efficacy, direct_efficacy;
    double luminances[4];
};
constexpr Weather kWeathers[] = {
    {20, 10, 180, 109.002120, 70.791644, {1.715305, 4.042789, 1.500600, 1.395182}},
    {40, 60, 260, 114.717423, 94.515264, {1.233286, 6.006879, 1.217565, 0.840882}},
    {35, 250, 350, 114.815130, 93.287353, {1.272126, 8.533411, 1.182197, 0.924840}},
    {50, 260, 300, 120.278149, 96.623071, {1.493512, 4.521495, 1.099247, 0.820060}},
    {12, 300, 60, 145.314573, 68.353599, {0.333402, 2.522614, 0.518440, 0.334337}},
    {45, 480, 160, 140.419216, 99.356488, {0.618942, 3.277317, 0.620855, 0.401303}},
    {55, 700, 130, 132.295449, 103.014930, {0.642133, 1.648830, 0.480277, 0.323150}},
    {60, 850, 90, 134.294835, 103.561466, {0.578279, 1.020854, 0.439489, 0.302711}}};

AllWeatherSky sky_of(const Weather& weather, double direct) {
    SkyWeather input;
    input.direct_normal = direct;
    input.diffuse_horizontal = weather.diffuse;
    return all_weather_sky(input, (90 - weather.elevation) * kPiD / 180);
}

double worst_difference(const AllWeatherSky& sky, const Weather& weather) {
    const V3d sun = direction(90 - weather.elevation, 0);
    const V3d towards[] = {{0, 0, 1}, direction(60, 0), direction(60, 90), direction(30, 180)};
    double worst = std::max(std::fabs(sky.diffuse_efficacy / weather.diffuse_efficacy - 1),
                            std::fabs(sky.direct_efficacy / weather.direct_efficacy - 1));
    for (int i = 0; i < 4; ++i) {
        const double found = sky.model.relative_luminance(towards[i], sun);
        worst = std::max(worst, std::fabs(found / weather.luminances[i] - 1));
    }
    return worst;
}

TEST(AllWeatherSky, EveryClassOfClearness_AgreesWithAnotherImplementation) {
    for (const Weather& weather : kWeathers) {
        EXPECT_LT(worst_difference(sky_of(weather, weather.direct), weather), 2e-6) << weather.elevation;
        // The weather of another class is refused.
        const double other = weather.direct > 500 ? 10 : 1000;
        EXPECT_GT(worst_difference(sky_of(weather, other), weather), 0.01) << weather.elevation;
    }
}

TEST(AllWeatherSky, DewPoint_GivesThePrecipitableWater) {
    EXPECT_NEAR(precipitable_water(11), 2.0, 0.01);
    EXPECT_NEAR(precipitable_water(0), 0.928, 0.001);
}

TEST(AllWeatherSky, Luminance_IsNeverNegative) {
    for (double elevation = 1; elevation < 90; elevation += 11) {
        for (double direct = 0; direct <= 1000; direct += 100) {
            for (double diffuse = 5; diffuse < 500; diffuse += 99) {
                const Weather weather{elevation, direct, diffuse, 0, 0, {}};
                const AllWeatherSky sky = sky_of(weather, direct);
                for (double z = 0; z <= 90; z += 10) {
                    const double found =
                        sky.model.relative_luminance(direction(z, 40), direction(90 - elevation, 0));
                    EXPECT_TRUE(found >= 0 && std::isfinite(found))
                        << elevation << ' ' << direct << ' ' << diffuse << ' ' << z << ": " << found;
                }
            }
        }
    }
}

}  // namespace sky_luminance_test
}  // namespace lucerna
