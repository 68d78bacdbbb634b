// Where a colour lies in the CIE's diagrams, and which black body it resembles: what a lamp's data sheet says
// of its light.
#pragma once

#include <optional>

#include "engine/base/vec.h"

namespace lucerna {

// Of CIE XYZ: x, y of 1931 and u', v' of 1976 [CIE 15:2004]. Requires a positive sum of components.
struct Chromaticity {
    double x, y;
    double u, v;  // u', v'
};
Chromaticity chromaticity(const V3d& xyz);

// The correlated colour temperature, that of the black body of the nearest chromaticity in the diagram of
// CIE 1960 (u = u', v = 2/3 v'), and the distance to it there: Duv, positive above the Planckian locus
// (greenish), negative below it (pinkish) [Ohno 2014].
struct ColourTemperature {
    double kelvin;
    double duv;
};

// Beyond this distance a colour resembles no black body: CIE 15:2004 gives it no temperature.
inline constexpr double kMostDuv = 0.05;
inline constexpr double kLeastKelvin = 1000, kMostKelvin = 1e6;

// By search for the least distance to the locus, Planck's law under the table of the observer; to within
// 0.01 K at 3000 K. None: the distance is more than kMostDuv, the temperature is not between kLeastKelvin and
// kMostKelvin, or XYZ is no colour (its sum not positive, or not finite).
std::optional<ColourTemperature> colour_temperature(const V3d& xyz);

}  // namespace lucerna
