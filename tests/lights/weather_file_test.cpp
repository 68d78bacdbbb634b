#include "lights/weather_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace weather_file_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

class WeatherFile : public ::testing::Test {
  protected:
    // Writes a file of 21 June whose line of 12 to 13 o'clock ends in the given values.
    std::filesystem::path file(const std::string& location, const std::string& values) const {
        const std::filesystem::path path = folder / "weather.epw";
        std::ofstream out(path);
        out << "LOCATION," << location << "\r\n";
        for (const char* line : {"DESIGN CONDITIONS,0", "TYPICAL/EXTREME PERIODS,0", "GROUND TEMPERATURES,0",
                                 "HOLIDAYS/DAYLIGHT SAVINGS,No,0,0,0", "COMMENTS 1,none", "COMMENTS 2,none",
                                 "DATA PERIODS,1,1,Data,Sunday,1/1,12/31"})
            out << line << "\r\n";
        out << "1999,6,21,12,0,flags,20,9.5,60,101000,1200,1330,300,600,500,150,0,0,0\r\n";
        out << "1999,6,21,13,0,flags," << values << "\r\n";
        return path;
    }
    static constexpr const char* kPlace = "Nowhere,-,-,none,0,50.9,11.6,1.0,150";
    std::string refusal(const std::string& location, const std::string& values,
                        const std::string& time = "06-21T12:30") const {
        return error_of([&] { read_weather_hour(file(location, values), time); });
    }
    const std::string good = "21,10,55,101000,1300,1330,300,700,620,140,75000,60000,16000";

    TemporaryFolder folder;
};

TEST_F(WeatherFile, Hour_HasPlaceTimeAndIrradiances) {
    const WeatherHour hour = read_weather_hour(file(kPlace, good), "06-21T12:00");
    EXPECT_EQ(hour.place.latitude, 50.9);
    EXPECT_EQ(hour.place.longitude, 11.6);
    EXPECT_NEAR(hour.days, days_since_2000(1999, 6, 21, 11.5), 1e-9) << "the hour's middle is 11:30 UT";
    EXPECT_EQ(hour.weather.direct_normal, 620);
    EXPECT_EQ(hour.weather.diffuse_horizontal, 140);
    EXPECT_EQ(hour.weather.precipitable_water, precipitable_water(10));
    EXPECT_EQ(read_weather_hour(folder / "weather.epw", "06-21T12:59").weather.direct_normal, 620);
    EXPECT_EQ(read_weather_hour(folder / "weather.epw", "06-21T11:59").weather.direct_normal, 500);
}

TEST_F(WeatherFile, MissingDewPoint_LeavesTheUsualWater) {
    const WeatherHour hour = read_weather_hour(
        file(kPlace, "21,99.9,55,101000,1300,1330,300,700,620,140,75000,60000,16000"), "06-21T12:30");
    EXPECT_EQ(hour.weather.precipitable_water, SkyWeather().precipitable_water);
}

TEST_F(WeatherFile, Faults_NameFileLineAndValue) {
    EXPECT_THAT(refusal("Nowhere,-,-,none,0,95,11.6,1.0,150", good),
                HasSubstr("weather.epw:1:1: the latitude, value 7, is \"95\"; expected -90 to 90"));
    EXPECT_THAT(refusal(kPlace, "21,10,55,101000,1300,1330,300,700,9999,140"),
                HasSubstr(":10:1: the direct normal radiation is missing at this hour (9999)"));
    EXPECT_THAT(refusal(kPlace, "21,10,55,101000,1300,1330,300,700,bright,140"),
                HasSubstr(":10:1: the direct normal radiation, value 15, is \"bright\"; expected 0 to 9999"));
    EXPECT_THAT(refusal(kPlace, "21,10"),
                HasSubstr(":10:1: the line ends before the direct normal radiation"));
    EXPECT_THAT(refusal(kPlace, good, "06-22T12:30"), HasSubstr("there is no line for 06-22T12:30"));
    EXPECT_THAT(refusal(kPlace, good, "2026-06-21T12:30Z"),
                HasSubstr("is no time of a weather file; expected month, day and time"));
    std::ofstream(folder / "other.epw") << "IESNA:LM-63\n";
    EXPECT_THAT(
        error_of([&] { read_weather_hour(folder / "other.epw", "06-21T12:30"); }),
        HasSubstr("other.epw:1:1: a weather file (EPW) begins with LOCATION, not with \"IESNA:LM-63\""));
}

}  // namespace weather_file_test
}  // namespace lucerna
