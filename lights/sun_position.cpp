#include "lights/sun_position.h"

#include <chrono>
#include <cmath>
#include <cstddef>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr double kArcsecond = kRadiansPerDegree / 3600;

// A term amplitude · cos(phase + rate · t), t in thousands of Julian years since 2000.
struct Term {
    double amplitude, phase, rate;  // rad, rad, rad per thousand years
};
// Terms of the Earth's heliocentric longitude. All that are left out together are below 6e-5 rad, and their
// root mean square is 1e-5 rad.
constexpr Term kLongitude0[] = {{1.75347046, 0, 0},
                                {0.03341656, 4.6692568, 6283.07585},
                                {0.00034894, 4.6261, 12566.1517},
                                {3.497e-5, 2.7441, 5753.3849},
                                {3.418e-5, 2.8289, 3.5231},
                                {3.136e-5, 3.6277, 77713.7715},
                                {2.676e-5, 4.4181, 7860.4194},
                                {2.343e-5, 6.1352, 3930.2097},
                                {1.324e-5, 0.7425, 11506.7698},
                                {1.273e-5, 2.0371, 529.691},
                                {1.199e-5, 1.1096, 1577.3435},
                                {9.9e-6, 5.233, 5884.927},
                                {9.02e-6, 2.045, 26.298},
                                {8.57e-6, 3.508, 398.149},
                                {7.8e-6, 1.179, 5223.694},
                                {7.53e-6, 2.533, 5507.553},
                                {5.05e-6, 4.583, 18849.228}};
constexpr Term kLongitude1[] = {
    {6283.31966747, 0, 0}, {0.00206059, 2.678235, 6283.07585}, {4.303e-5, 2.6351, 12566.1517}};
constexpr Term kLongitude2[] = {{0.00052919, 0, 0}, {8.72e-5, 1.0721, 6283.0758}};
// Terms of the distance [au], accurate to 1e-4 au.
constexpr Term kDistance0[] = {
    {1.00013989, 0, 0}, {0.016707, 3.0984635, 6283.07585}, {0.00013956, 3.05525, 12566.1517}};

template <std::size_t n>
double sum_of(const Term (&terms)[n], double t) {
    double sum = 0;
    for (const Term& term : terms) sum += term.amplitude * cos(term.phase + term.rate * t);
    return sum;
}

// The largest terms of the nutation and the obliquity of the ecliptic [Meeus 1998, 22], `t` in Julian
// centuries since 2000.
struct Ecliptic {
    double nutation_in_longitude, obliquity;  // rad
};
Ecliptic ecliptic(double t) {
    const double node = (125.04452 - 1934.136261 * t) * kRadiansPerDegree;
    const double sun = (280.4665 + 36000.7698 * t) * kRadiansPerDegree;
    const double moon = (218.3165 + 481267.8813 * t) * kRadiansPerDegree;
    const double in_longitude =
        -17.20 * sin(node) - 1.32 * sin(2 * sun) - 0.23 * sin(2 * moon) + 0.21 * sin(2 * node);
    const double in_obliquity =
        9.20 * cos(node) + 0.57 * cos(2 * sun) + 0.10 * cos(2 * moon) - 0.09 * cos(2 * node);
    return {in_longitude * kArcsecond, (84381.448 - 46.815 * t + in_obliquity) * kArcsecond};
}

// Returns the angle in [0, 2π).
double turned(double angle) {
    constexpr double kTurn = 2 * kPiD;
    const double rest = angle - kTurn * std::floor(angle / kTurn);
    return rest < kTurn ? rest : 0.0;
}

// Takes digits of a fixed width from the start of the text; none if they are others.
std::optional<int> digits(std::string_view& text, std::size_t count) {
    if (text.size() < count) return std::nullopt;
    int value = 0;
    for (const char c : text.substr(0, count)) {
        if (c < '0' || c > '9') return std::nullopt;
        value = 10 * value + (c - '0');
    }
    text.remove_prefix(count);
    return value;
}
bool takes(std::string_view& text, char c) {
    if (!text.starts_with(c)) return false;
    text.remove_prefix(1);
    return true;
}

// Takes "12:00" or "12:00:30" and returns hours.
std::optional<double> parse_clock(std::string_view& text, bool seconds_allowed) {
    const auto hour = digits(text, 2);
    if (!hour || *hour > 24 || !takes(text, ':')) return std::nullopt;
    const auto minute = digits(text, 2);
    if (!minute || *minute > 59) return std::nullopt;
    double hours = *hour + *minute / 60.0;
    if (seconds_allowed && takes(text, ':')) {
        const auto second = digits(text, 2);
        if (!second || *second > 60) return std::nullopt;
        hours += *second / 3600.0;
    }
    return hours > 24 ? std::nullopt : std::optional(hours);
}

// Takes "Z" or "+02:00" from the text, which must end there, and returns hours.
std::optional<double> parse_zone(std::string_view text) {
    if (text == "Z") return 0.0;
    const bool west = text.starts_with('-');
    if (!west && !text.starts_with('+')) return std::nullopt;
    text.remove_prefix(1);
    const auto hours = parse_clock(text, false);
    if (!hours || !text.empty() || *hours > 14) return std::nullopt;
    return west ? -*hours : *hours;
}

}  // namespace

double days_since_2000(int year, int month, int day, double hour) {
    const auto days_of = [](int y, int m, int d) {
        return std::chrono::sys_days(std::chrono::year(y) / std::chrono::month(static_cast<unsigned>(m)) /
                                     std::chrono::day(static_cast<unsigned>(d)));
    };
    const auto days = (days_of(year, month, day) - days_of(2000, 1, 1)).count();
    return static_cast<double>(days) + (hour - 12) / 24;
}

std::optional<double> parse_time(std::string_view text) {
    constexpr int kFirst = 1900, kLast = 2100;
    const auto year = digits(text, 4);
    if (!year || *year < kFirst || *year > kLast || !takes(text, '-')) return std::nullopt;
    const auto month = digits(text, 2);
    if (!month || !takes(text, '-')) return std::nullopt;
    const auto day = digits(text, 2);
    if (!day || !takes(text, 'T')) return std::nullopt;
    const std::chrono::year_month_day date(std::chrono::year(*year),
                                           std::chrono::month(static_cast<unsigned>(*month)),
                                           std::chrono::day(static_cast<unsigned>(*day)));
    if (!date.ok()) return std::nullopt;
    const auto hours = parse_clock(text, true);
    if (!hours) return std::nullopt;
    const auto zone = parse_zone(text);
    if (!zone) return std::nullopt;
    return days_since_2000(*year, *month, *day, *hours - *zone);
}

ApparentSun apparent_sun(double days) {
    // Terrestrial time is ahead of universal time by 29 s in 1950, 69 s in 2025 and some 90 s in 2050. The
    // sun moves by 0.0007° in 60 s.
    constexpr double kDeltaT = 69.0 / 86400;  // days
    const double t = (days + kDeltaT) / 365250;
    const double earth = sum_of(kLongitude0, t) + t * (sum_of(kLongitude1, t) + t * sum_of(kLongitude2, t));
    const double distance = sum_of(kDistance0, t);
    const auto [nutation, obliquity] = ecliptic(10 * t);
    // The terms are of the dynamical equinox, which lies 0.09" from that of FK5.
    const double aberration = -20.4898 * kArcsecond / distance, to_fk5 = -0.09033 * kArcsecond;
    const double longitude = turned(earth + kPiD + to_fk5 + nutation + aberration);
    return {longitude, turned(atan2(cos(obliquity) * sin(longitude), cos(longitude))),
            asin(sin(obliquity) * sin(longitude)), distance};
}

SunPosition sun_position(double days, const GeographicPlace& place) {
    const ApparentSun sun = apparent_sun(days);
    const double t = days / 36525;
    const auto [nutation, obliquity] = ecliptic(t);
    const double sidereal =
        (280.46061837 + 360.98564736629 * days + 0.000387933 * t * t) * kRadiansPerDegree +
        nutation * cos(obliquity);
    const double latitude = place.latitude * kRadiansPerDegree;
    const double hour_angle = sidereal + place.longitude * kRadiansPerDegree - sun.right_ascension;
    const double east = -cos(sun.declination) * sin(hour_angle);
    const double north =
        cos(latitude) * sin(sun.declination) - sin(latitude) * cos(sun.declination) * cos(hour_angle);
    const double up =
        sin(latitude) * sin(sun.declination) + cos(latitude) * cos(sun.declination) * cos(hour_angle);
    // The parallax is that of a sphere, whose error is below 0.01".
    const double elevation = atan2(up, hypot(east, north));
    const double parallax = 8.794 * kArcsecond / sun.distance * cos(elevation);
    return {elevation - parallax, turned(atan2(east, north)), sun.distance};
}

double refraction(double elevation) {
    const double degrees = elevation / kRadiansPerDegree;
    constexpr double kGone = -0.84;  // the upper limb is at the horizon: radius and refraction
    if (degrees < kGone) return 0;
    const double minutes = 1.02 / tan((degrees + 10.3 / (degrees + 5.11)) * kRadiansPerDegree);
    return std::fmax(0.0, minutes) / 60 * kRadiansPerDegree;
}

V3d SunPosition::direction() const {
    const double seen = elevation + refraction(elevation);
    return {cos(seen) * sin(azimuth), cos(seen) * cos(azimuth), sin(seen)};
}

}  // namespace lucerna
