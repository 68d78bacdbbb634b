#include "lights/sky_luminance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

// The gradations and indicatrices of ISO 15469:2004, Table 1, from which each type takes one of either.
struct Gradation {
    double a, b;
};
struct Indicatrix {
    double c, d, e;
};
constexpr Gradation kGradations[] = {{4, -0.7}, {1.1, -0.8}, {0, -1}, {-1, -0.55}, {-1, -0.32}, {-1, -0.15}};
constexpr Indicatrix kIndicatrices[] = {{0, -1, 0},     {2, -1.5, 0.15}, {5, -2.5, 0.3},
                                        {10, -3, 0.45}, {16, -3, 0.3},   {24, -2.8, 0.15}};
struct CieType {
    int gradation, indicatrix;
};
constexpr CieType kTypes[] = {{0, 0}, {0, 1}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}, {2, 3},
                              {3, 1}, {3, 2}, {3, 3}, {4, 3}, {4, 4}, {5, 4}, {5, 5}};

// Perez et al. 1993, Table 1: for each of a to e the four numbers x1 to x4, by classes of clearness.
using Class = std::array<std::array<double, 4>, 5>;
constexpr Class kClasses[] = {{{{1.3525, -0.2576, -0.2690, -1.4366},
                                {-0.7670, 0.0007, 1.2734, -0.1233},
                                {2.8000, 0.6004, 1.2375, 1.0000},
                                {1.8734, 0.6297, 0.9738, 0.2809},
                                {0.0356, -0.1246, -0.5718, 0.9938}}},
                              {{{-1.2219, -0.7730, 1.4148, 1.1016},
                                {-0.2054, 0.0367, -3.9128, 0.9156},
                                {6.9750, 0.1774, 6.4477, -0.1239},
                                {-1.5798, -0.5081, -1.7812, 0.1080},
                                {0.2624, 0.0672, -0.2190, -0.4285}}},
                              {{{-1.1000, -0.2515, 0.8952, 0.0156},
                                {0.2782, -0.1812, -4.5000, 1.1766},
                                {24.7219, -13.0812, -37.7000, 34.8438},
                                {-5.0000, 1.5218, 3.9229, -2.6204},
                                {-0.0156, 0.1597, 0.4199, -0.5562}}},
                              {{{-0.5484, -0.6654, -0.2672, 0.7117},
                                {0.7234, -0.6219, -5.6812, 2.6297},
                                {33.3389, -18.3000, -62.2500, 52.0781},
                                {-3.5000, 0.0016, 1.1477, 0.1062},
                                {0.4659, -0.3296, -0.0876, -0.0329}}},
                              {{{-0.6000, -0.3566, -2.5000, 2.3250},
                                {0.2937, 0.0496, -5.6812, 1.8415},
                                {21.0000, -4.7656, -21.5906, 7.2492},
                                {-3.5000, -0.1554, 1.4062, 0.3988},
                                {0.0032, 0.0766, -0.0656, -0.1294}}},
                              {{{-1.0156, -0.3670, 1.0078, 1.4051},
                                {0.2875, -0.5328, -3.8500, 3.3750},
                                {14.0000, -0.9999, -7.1406, 7.5469},
                                {-3.4000, -0.1078, -1.0750, 1.5702},
                                {-0.0672, 0.4016, 0.3017, -0.4844}}},
                              {{{-1.0000, 0.0211, 0.5025, -0.5119},
                                {-0.3000, 0.1922, 0.7023, -1.6317},
                                {19.0000, -5.0000, 1.2438, -1.9094},
                                {-4.0000, 0.0250, 0.3844, 0.2656},
                                {1.0468, -0.3788, -2.4517, 1.4656}}},
                              {{{-1.0500, 0.0289, 0.4260, 0.3590},
                                {-0.3250, 0.1156, 0.7781, 0.0025},
                                {31.0625, -14.5000, -46.1148, 55.3750},
                                {-7.2312, 0.4050, 13.3500, 0.6234},
                                {1.5000, -0.6426, 1.8564, 0.5636}}}};

// Perez et al. 1990, Table 4: coefficients of the luminous efficacies by the same classes.
struct Efficacy {
    double a, b, c, d;
};
constexpr Efficacy kDiffuse[] = {{97.24, -0.46, 12.00, -8.91},   {107.22, 1.15, 0.59, -3.95},
                                 {104.97, 2.96, -5.53, -8.77},   {102.39, 5.59, -13.95, -13.90},
                                 {100.71, 5.94, -22.75, -23.74}, {106.42, 3.83, -36.15, -28.83},
                                 {141.88, 1.90, -53.24, -14.03}, {152.23, 0.35, -45.27, -7.98}};
constexpr Efficacy kDirect[] = {{57.20, -4.55, -2.98, 117.12}, {98.99, -3.46, -1.21, 12.38},
                                {109.83, -4.90, -1.71, -8.81}, {110.34, -5.84, -1.99, -4.56},
                                {106.36, -3.97, -1.75, -6.16}, {107.19, -1.25, -1.51, -26.73},
                                {105.75, 0.77, -1.26, -34.44}, {101.18, 1.58, -1.10, -8.29}};

// Returns the class of a clearness of at least 1 [Perez et al. 1990, Table 1].
std::size_t class_of(double clearness) {
    constexpr double kUpper[] = {1.065, 1.230, 1.500, 1.950, 2.800, 4.500, 6.200};
    return static_cast<std::size_t>(std::upper_bound(std::begin(kUpper), std::end(kUpper), clearness) -
                                    std::begin(kUpper));
}

// Returns the relative optical air mass for the sun's angle to the zenith in radians [Kasten 1966].
double air_mass(double zenith) {
    return 1 / (cos(zenith) + 0.15 * pow(93.885 - zenith / kRadiansPerDegree, -1.253));
}

// Evaluates eq. 6 to 8 of Perez et al. 1993. Two limits keep the luminance bounded at the horizon, where it
// has no bound if b > 0: the least brightness between overcast and clear skies, which is that of Radiance's
// gendaylit, and b itself.
SkyModel all_weather_model(std::size_t of_class, double brightness, double zenith) {
    constexpr double kLeastBetween = 0.2;
    constexpr std::size_t kFirstBetween = 1, kLastBetween = 4;
    if (of_class >= kFirstBetween && of_class <= kLastBetween)
        brightness = std::max(brightness, kLeastBetween);
    const Class& x = kClasses[of_class];
    const auto linear = [&](int i) {
        const auto& [x1, x2, x3, x4] = x[static_cast<std::size_t>(i)];
        return x1 + x2 * zenith + brightness * (x3 + x4 * zenith);
    };
    SkyModel model{linear(0), std::min(0.0, linear(1)), linear(2), linear(3), linear(4)};
    if (of_class > 0) return model;
    model.c = exp(pow(brightness * (x[2][0] + x[2][1] * zenith), x[2][2])) - x[2][3];
    model.d = -exp(brightness * (x[3][0] + x[3][1] * zenith)) + x[3][2] + brightness * x[3][3];
    return model;
}

}  // namespace

double SkyModel::relative_luminance(const V3d& w, const V3d& sun) const {
    if (w.z < 0) return 0;
    if (traditional) return (1 + 2 * w.z) / 3;
    constexpr double kLeastCosine = 1e-6;  // where exp(b / cos Z) has its limit at the horizon
    const double gradation = 1 + a * exp(b / std::max(w.z, kLeastCosine));
    const double chi = 2 * asin(std::min(1.0, (w - sun).length() / 2));
    const double indicatrix = 1 + c * (exp(d * chi) - offset) + e * sqr(cos(chi));
    return std::max(0.0, gradation * indicatrix);
}

std::optional<SkyModel> cie_sky(int type) {
    if (type < 1 || type > kCieSkies) return std::nullopt;
    SkyModel model;
    model.traditional = type == kCieSkies;
    if (model.traditional) return model;
    const CieType& of = kTypes[type - 1];
    const Gradation& gradation = kGradations[of.gradation];
    const Indicatrix& indicatrix = kIndicatrices[of.indicatrix];
    return SkyModel{gradation.a,  gradation.b,  indicatrix.c,
                    indicatrix.d, indicatrix.e, exp(indicatrix.d * kPiD / 2)};
}

double precipitable_water(double dew_point) {
    return exp(0.07 * dew_point - 0.075);
}

AllWeatherSky all_weather_sky(const SkyWeather& weather, double sun_zenith) {
    constexpr double kSolarConstant = 1367;  // W/m², that of the papers
    const double cubed = 1.041 * sun_zenith * sun_zenith * sun_zenith;
    const double clearness =
        1 + weather.direct_normal / weather.diffuse_horizontal / (1 + cubed);  // eq. 1 of 1990
    const double brightness =
        weather.diffuse_horizontal * air_mass(sun_zenith) * sqr(weather.sun_distance) / kSolarConstant;
    const std::size_t of_class = class_of(clearness);
    const Efficacy &diffuse = kDiffuse[of_class], &direct = kDirect[of_class];
    const double water = weather.precipitable_water;
    return {all_weather_model(of_class, brightness, sun_zenith),
            diffuse.a + diffuse.b * water + diffuse.c * cos(sun_zenith) + diffuse.d * log(brightness),
            std::max(0.0, direct.a + direct.b * water + direct.c * exp(5.73 * sun_zenith - 5) +
                              direct.d * brightness)};
}

}  // namespace lucerna
