// Luminance of the sky by direction: the CIE standard general sky and the all-weather model.
//
// Both models multiply a gradation from the zenith to the horizon by an indicatrix, which depends on the
// angle χ to the sun [ISO 15469:2004; Perez et al. 1993, eq. 1]:
//
//     (1 + a exp(b / cos Z)) · (1 + c (exp(d χ) - exp(d π/2)) + e cos² χ)
//
// Z is the angle to the zenith. The all-weather model lacks the term exp(d π/2), and its coefficients depend
// on the irradiances. Vectors are unit vectors in the sky's frame: x points east, y north, z to the zenith.
#pragma once

#include <optional>

#include "engine/base/vec.h"

namespace lucerna {

struct SkyModel {
    double a = 0, b = -1, c = 0, d = -1, e = 0;
    double offset = 0;         // subtracted from exp(d χ)
    bool traditional = false;  // the traditional overcast sky, (1 + 2 cos Z) / 3, replaces the formula

    // Whether the luminance depends on the sun's place.
    bool has_sun() const { return !traditional && (c != 0 || e != 0); }
    // Returns the relative luminance towards w, at least 0, and 0 below the horizon.
    double relative_luminance(const V3d& w, const V3d& sun) const;
};

// Returns the sky of a type of ISO 15469:2004, Table 1: 1 to 15, and 16, the traditional overcast sky.
// Returns none for any other number.
inline constexpr int kCieSkies = 16;
std::optional<SkyModel> cie_sky(int type);

// The weather at one time, from which the all-weather model follows.
struct SkyWeather {
    double direct_normal = 0;         // irradiance by the sun of a plane that faces it [W/m²]
    double diffuse_horizontal = 0;    // irradiance by the sky of a horizontal plane [W/m²], > 0
    double sun_distance = 1;          // [au]
    double precipitable_water = 2.0;  // [cm]
};
// Returns the precipitable water for a dew point in °C [Perez et al. 1990, eq. 3].
double precipitable_water(double dew_point);

// Describes the all-weather sky.
struct AllWeatherSky {
    SkyModel model;
    // Luminous efficacies of the light of the sky and of the sun [lm/W; Perez et al. 1990, eq. 7 and 8].
    double diffuse_efficacy, direct_efficacy;
};
// `sun_zenith` is the sun's angle to the zenith in radians, from 0 to π/2.
AllWeatherSky all_weather_sky(const SkyWeather& weather, double sun_zenith);

}  // namespace lucerna
