// Weather files of EnergyPlus (EPW) [EnergyPlus 2023, 2.9]: the irradiances of one hour, and the place.
#pragma once

#include <filesystem>
#include <string_view>

#include "lights/sky_luminance.h"
#include "lights/sun_position.h"

namespace lucerna {

// The line of an hour.
struct WeatherHour {
    GeographicPlace place;
    double days;         // the middle of the hour, in days since 2000-01-01 12:00 UT
    SkyWeather weather;  // its sun_distance is 1
};

// Reads the line whose hour contains the time, "06-21T12:30": month, day, hour and minute of the file's own
// clock, its standard time. 12:00 belongs to the hour that begins then. Where the dew point is missing, the
// precipitable water is 2 cm. Throws InputError that names file and line, or that the time is faulty or not
// in the file.
WeatherHour read_weather_hour(const std::filesystem::path& file, std::string_view time);

}  // namespace lucerna
