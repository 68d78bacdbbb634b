// Computes chromaticity in the CIE diagrams and correlated colour temperature, as stated in a lamp's data
// sheet.
#pragma once

#include <optional>

#include "engine/base/vec.h"

namespace lucerna {

// Holds x, y of 1931 and u', v' of 1976 [CIE 15:2004] of CIE XYZ, whose components' sum must be positive.
struct Chromaticity {
    double x, y;
    double u, v;  // u', v'
};
Chromaticity chromaticity(const V3d& xyz);

// Holds the correlated colour temperature, that of the black body with the nearest chromaticity in the CIE
// 1960 diagram (u = u', v = 2/3 v'), and the distance to it there: Duv, positive above the Planckian locus
// (greenish), negative below it (pinkish) [Ohno 2014].
struct ColourTemperature {
    double kelvin;
    double duv;
};

// CIE 15:2004 defines no colour temperature beyond this distance from the locus.
inline constexpr double kMostDuv = 0.05;
inline constexpr double kLeastKelvin = 1000, kMostKelvin = 1e6;

// Searches the least distance to the locus, which follows from Planck's law and the observer's table; the
// result is accurate to 0.01 K at 3000 K. Returns none if the distance exceeds kMostDuv, if the temperature
// is not between kLeastKelvin and kMostKelvin, or if XYZ is no colour (its sum not positive or not finite).
std::optional<ColourTemperature> colour_temperature(const V3d& xyz);

}  // namespace lucerna
