#include "lights/weather_file.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

// Columns of a data line, from 0.
constexpr std::size_t kMonth = 1, kDay = 2, kHour = 3, kDewPoint = 7, kDirectNormal = 14, kDiffuse = 15;
constexpr std::size_t kHeaderLines = 8;

std::vector<std::string_view> fields_of(std::string_view line) {
    std::vector<std::string_view> fields;
    for (;;) {
        const std::size_t comma = line.find(',');
        fields.push_back(trimmed(line.substr(0, comma)));
        if (comma == std::string_view::npos) return fields;
        line.remove_prefix(comma + 1);
    }
}

// A line of the file, whose numbers are read with their limits.
struct WeatherLine {
    const std::string& file;
    int number;
    std::vector<std::string_view> fields;

    Location place() const { return {file, number, 1}; }
    double value(std::size_t column, std::string_view what, double least, double most) const {
        if (column >= fields.size())
            input_error(place(), "the line ends before {}, value {}", what, column + 1);
        const auto found = number_of(fields[column]);
        if (!found || !(*found >= least && *found <= most)) {
            input_error(place(), "{}, value {}, is \"{}\"; expected {:g} to {:g}", what, column + 1,
                        shown_value(fields[column]), least, most);
        }
        return *found;
    }
    int whole(std::size_t column, std::string_view what, int least, int most) const {
        return static_cast<int>(value(column, what, least, most));
    }
};

struct Header {
    GeographicPlace place;
    double zone;  // hours, east positive
};
Header read_header(const WeatherLine& line) {
    if (line.fields.front() != "LOCATION")
        input_error(line.place(), "a weather file (EPW) begins with LOCATION, not with \"{}\"",
                    shown_value(line.fields.front()));
    return {{line.value(6, "the latitude", -90, 90), line.value(7, "the longitude", -180, 180)},
            line.value(8, "the time zone", -12, 14)};
}

struct Moment {
    int month, day, hour;  // hour from 1: the 1st ends at 1 o'clock
};
// Parses "06-21T12:30".
std::optional<Moment> parse_moment(std::string_view text) {
    constexpr std::string_view kPattern = "00-00T00:00";
    if (text.size() != kPattern.size()) return std::nullopt;
    std::array<int, 4> numbers{};
    std::size_t next = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const bool digit = text[i] >= '0' && text[i] <= '9';
        if (kPattern[i] == '0' ? !digit : text[i] != kPattern[i]) return std::nullopt;
        if (digit) {
            numbers[next] = 10 * numbers[next] + (text[i] - '0');
        } else {
            ++next;
        }
    }
    const auto [month, day, hour, minute] = numbers;
    if (hour > 23 || minute > 59) return std::nullopt;
    return Moment{month, day, hour + 1};
}

SkyWeather weather_of(const WeatherLine& line) {
    constexpr double kMissing = 9999;  // W/m²
    const auto irradiance = [&](std::size_t column, std::string_view what) {
        const double value = line.value(column, what, 0, kMissing);
        if (value == kMissing) input_error(line.place(), "{} is missing at this hour (9999)", what);
        return value;
    };
    SkyWeather weather;
    weather.direct_normal = irradiance(kDirectNormal, "the direct normal radiation");
    weather.diffuse_horizontal = irradiance(kDiffuse, "the diffuse horizontal radiation");
    constexpr double kNoDewPoint = 99.9;  // °C, the mark of a missing value
    const double dew_point = line.value(kDewPoint, "the dew point", -100, kNoDewPoint);
    if (dew_point < kNoDewPoint) weather.precipitable_water = precipitable_water(dew_point);
    return weather;
}

}  // namespace

WeatherHour read_weather_hour(const std::filesystem::path& file, std::string_view time) {
    const std::string name = file.string();
    const auto moment = parse_moment(time);
    if (!moment) {
        input_error({name},
                    "\"{}\" is no time of a weather file; expected month, day and time of its own clock: "
                    "06-21T12:30",
                    shown_value(time));
    }
    const std::string text = read_text(file);
    const std::vector<TextLine> lines = lines_of(without_byte_order_mark(text));
    if (lines.empty()) input_error({name}, "the file is empty");
    const auto line_of = [&](const TextLine& line) {
        return WeatherLine{name, line.number, fields_of(line.text)};
    };
    const Header header = read_header(line_of(lines.front()));
    for (std::size_t i = kHeaderLines; i < lines.size(); ++i) {
        if (trimmed(lines[i].text).empty()) continue;
        const WeatherLine line = line_of(lines[i]);
        if (line.whole(kMonth, "the month", 1, 12) != moment->month ||
            line.whole(kDay, "the day", 1, 31) != moment->day ||
            line.whole(kHour, "the hour", 1, 24) != moment->hour)
            continue;
        const int year = line.whole(0, "the year", 1900, 2100);
        const double middle = moment->hour - 0.5 - header.zone;
        return {header.place, days_since_2000(year, moment->month, moment->day, middle), weather_of(line)};
    }
    input_error({name}, "there is no line for {}", shown_value(time));
}

}  // namespace lucerna
