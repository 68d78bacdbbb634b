// The place of the sun in the sky, by time and place on Earth.
//
// The longitude of the Earth follows from the largest terms of VSOP87 [Bretagnon and Francou 1988]; nutation,
// aberration, sidereal time, parallax and refraction follow [Meeus 1998, 12, 13, 16, 22, 25, 40]. From 1900
// to 2100 the place differs by at most 0.002° from that by all terms of [Reda and Andreas 2004].
#pragma once

#include <optional>
#include <string_view>

#include "engine/base/vec.h"

namespace lucerna {

// Returns the time of a date of the Gregorian calendar in days since 2000-01-01 12:00, both in universal
// time. `hour` may lie outside a day.
double days_since_2000(int year, int month, int day, double hour);
// Parses a time of ISO 8601, "2026-06-21T12:00:00+02:00": seconds may be missing, "Z" stands for +00:00.
// Returns none for any other text, and for years outside 1900 to 2100.
std::optional<double> parse_time(std::string_view text);

// The apparent place of the sun's centre, as seen from the centre of the Earth.
struct ApparentSun {
    double longitude;                     // in the ecliptic of date [rad]
    double right_ascension, declination;  // of the true equator and equinox of date [rad]
    double distance;                      // [au]
};
ApparentSun apparent_sun(double days);

struct GeographicPlace {
    double latitude = 0, longitude = 0;  // [degrees], north and east positive
};
// The place of the sun's centre above the horizon of a place.
struct SunPosition {
    double elevation;  // without refraction [rad]
    double azimuth;    // from north over east [rad], in [0, 2π)
    double distance;   // [au]

    // Returns the unit vector to the sun: x points east, y north, z to the zenith. Refraction raises it as an
    // atmosphere of 1010 hPa and 10 °C does [Meeus 1998, 16.4].
    V3d direction() const;
};
SunPosition sun_position(double days, const GeographicPlace& place);

// Returns the refraction [rad] by that atmosphere, for an elevation without refraction [rad]; 0 for a sun
// entirely below the horizon.
double refraction(double elevation);

// Half the angle that the sun's disc subtends at its mean distance [rad].
inline constexpr double kSunRadius = 0.533 / 2 * kRadiansPerDegree;

}  // namespace lucerna
