#include "lights/sun_position.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace lucerna {
namespace sun_position_test {

constexpr double kDegree = kPiD / 180;
constexpr double kTolerance = 0.01;  // degrees

// Returns the difference of two angles in degrees, of at most 180 degrees.
double apart(double a, double b) {
    return std::fabs(std::remainder(a - b, 360.0));
}

struct Almanac {
    int day;
    double right_ascension, declination;  // degrees
};
double of_hours(double h, double m, double s) {
    return 15 * (h + m / 60 + s / 3600);
}
double of_degrees(double d, double m, double s) {
    return d + m / 60 + s / 3600;
}

// The U.S. Naval Observatory's apparent geocentric positions of the sun at 0 h UT1 of days of September 2007
// [PyEphem 2008].
const Almanac kGeocentric[] = {{25, of_hours(12, 5, 42.537), -of_degrees(0, 37, 7.31)},
                               {26, of_hours(12, 9, 18.224), -of_degrees(1, 0, 28.87)},
                               {27, of_hours(12, 12, 54.079), -of_degrees(1, 23, 50.31)},
                               {28, of_hours(12, 16, 30.129), -of_degrees(1, 47, 11.33)},
                               {29, of_hours(12, 20, 6.402), -of_degrees(2, 10, 31.63)}};

// Returns the largest difference [degrees] if the clock is wrong by some hours.
double worst_of_geocentric(double hours_wrong) {
    double worst = 0;
    for (const Almanac& of : kGeocentric) {
        const ApparentSun sun = apparent_sun(days_since_2000(2007, 9, of.day, hours_wrong));
        worst = std::max({worst, apart(sun.right_ascension / kDegree, of.right_ascension),
                          apart(sun.declination / kDegree, of.declination)});
    }
    return worst;
}

TEST(SunPosition, Geocentric_IsThatOfTheNavalObservatory) {
    EXPECT_LT(worst_of_geocentric(0), kTolerance);
    EXPECT_GT(worst_of_geocentric(1), kTolerance) << "an error of an hour is refused";
}

// The tables also have the sun for an observer in Atlanta on 26 September 2007, 0 h UT1. The place above the horizon follows
// from Greenwich mean sidereal time and the equation of the equinoxes, 0 h 18 m 19.7 s.
TEST(SunPosition, Topocentric_IsThatOfTheNavalObservatory) {
    const GeographicPlace atlanta{33.76, -84.41};
    const double days = days_since_2000(2007, 9, 26, 0);
    const double sidereal = 280.46061837 + 360.98564736629 * days + 0.0023;  // degrees, apparent
    const double hour_angle = (sidereal + atlanta.longitude - of_hours(12, 9, 17.739)) * kDegree;
    const double declination = -of_degrees(1, 0, 33.71) * kDegree, latitude = atlanta.latitude * kDegree;
    const double elevation = std::asin(std::sin(latitude) * std::sin(declination) +
                                       std::cos(latitude) * std::cos(declination) * std::cos(hour_angle));
    const double azimuth =
        kPiD + std::atan2(std::sin(hour_angle), std::cos(hour_angle) * std::sin(latitude) -
                                                    std::tan(declination) * std::cos(latitude));
    const SunPosition sun = sun_position(days, atlanta);
    EXPECT_LT(apart(sun.elevation / kDegree, elevation / kDegree), kTolerance);
    EXPECT_LT(apart(sun.azimuth / kDegree, azimuth / kDegree), kTolerance);
    EXPECT_NEAR(sun.distance, 1.0028, 1e-4);
    const SunPosition elsewhere = sun_position(days, {33.76, 84.41});
    EXPECT_GT(apart(elsewhere.azimuth / kDegree, azimuth / kDegree), 1) << "west is not east";
}

// Equinoxes and solstices by the U.S. Naval Observatory, to a minute [PyEphem 2008], in which the sun moves
// by 0.0007 degrees.
struct Seasons {
    int year;
    struct {
        int day, hour, minute;
    } march, june, september, december;
};
constexpr Seasons kSeasons[] = {{2000, {20, 7, 35}, {21, 1, 48}, {22, 17, 27}, {21, 13, 37}},
                                {2003, {21, 1, 0}, {21, 19, 10}, {23, 10, 47}, {22, 7, 4}},
                                {2007, {21, 0, 7}, {21, 18, 6}, {23, 9, 51}, {22, 6, 8}},
                                {2010, {20, 17, 32}, {21, 11, 28}, {23, 3, 9}, {21, 23, 38}},
                                {2013, {20, 11, 2}, {21, 5, 4}, {22, 20, 44}, {21, 17, 11}},
                                {2016, {20, 4, 30}, {20, 22, 34}, {22, 14, 21}, {21, 10, 44}},
                                {2018, {20, 16, 15}, {21, 10, 7}, {23, 1, 54}, {21, 22, 22}},
                                {2020, {20, 3, 49}, {20, 21, 43}, {22, 13, 30}, {21, 10, 2}}};

TEST(SunPosition, EquinoxesAndSolstices_AreThoseOfTheNavalObservatory) {
    for (const Seasons& seasons : kSeasons) {
        const auto& [year, march, june, september, december] = seasons;
        double longitude = 0;
        int month = 3;
        for (const auto& at : {march, june, september, december}) {
            const double days = days_since_2000(year, month, at.day, at.hour + at.minute / 60.0);
            EXPECT_LT(apart(apparent_sun(days).longitude / kDegree, longitude), kTolerance)
                << year << ' ' << month;
            EXPECT_GT(apart(apparent_sun(days + 0.5).longitude / kDegree, longitude), kTolerance)
                << "an error of half a day is refused";
            longitude += 90;
            month += 3;
        }
    }
}

// The example of [Reda and Andreas 2004, Appendix A.5]: its place without refraction, and with that of 820
// hPa and 11 °C.
TEST(SunPosition, Example_IsThatOfReda) {
    const SunPosition sun =
        sun_position(parse_time("2003-10-17T12:30:30-07:00").value(), {39.742476, -105.1786});
    EXPECT_NEAR(sun.elevation / kDegree, 39.872046, kTolerance / 10);
    EXPECT_NEAR(sun.azimuth / kDegree, 194.340241, kTolerance / 10);
    EXPECT_NEAR(refraction(sun.elevation) / kDegree * 820 / 1010 * 283 / 284, 0.016332, 1e-4);
    const V3d w = sun.direction();
    EXPECT_NEAR(std::asin(w.z) / kDegree, 39.872046 + 0.0202, 1e-3);
    EXPECT_NEAR(std::atan2(w.x, w.y) / kDegree, 194.340241 - 360, 1e-3);
}

TEST(SunPosition, Refraction_RaisesTheHorizonByHalfADegree) {
    EXPECT_NEAR(refraction(0) / kDegree, 0.483, 0.01);
    EXPECT_NEAR(refraction(kPiD / 2), 0, 1e-6);
    EXPECT_EQ(refraction(-2 * kDegree), 0);
}

TEST(ParseTime, Zones_GiveUniversalTime) {
    const double noon = days_since_2000(2026, 6, 21, 12);
    for (const char* text :
         {"2026-06-21T12:00:00Z", "2026-06-21T12:00Z", "2026-06-21T14:00:00+02:00", "2026-06-21T06:30-05:30"})
        EXPECT_NEAR(parse_time(text).value_or(0), noon, 1e-9) << text;
    EXPECT_EQ(days_since_2000(2000, 1, 1, 12), 0);
    EXPECT_NEAR(days_since_2000(1992, 10, 13, 0), 2448908.5 - 2451545, 1e-9);
}

TEST(ParseTime, OtherTexts_AreRefused) {
    for (const char* text :
         {"", "2026-06-21", "2026-06-21T12:00", "2026-06-21 12:00Z", "2026-02-30T12:00Z", "2026-13-01T12:00Z",
          "2026-06-21T25:00Z", "2026-06-21T12:61Z", "2026-06-21T12:00:00+02", "2026-06-21T12:00:00+02:00x",
          "1850-06-21T12:00Z", "2101-06-21T12:00Z", "26-06-21T12:00Z", "2026-06-21T12:00:00+99:00"})
        EXPECT_FALSE(parse_time(text)) << text;
}

}  // namespace sun_position_test
}  // namespace lucerna
