#include "engine/text/units.h"

#include <fmt/core.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

// Returns the number, if the whole word is one.
template <typename T>
std::optional<T> whole_word(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
}

struct Unit {
    std::string_view name;
    double size;  // in the SI unit
};
// "m" comes last, because "mm" ends in it, too.
constexpr std::array<Unit, 5> kLengthUnits{
    {{"um", 1e-6}, {"µm", 1e-6}, {"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}}};
constexpr std::array<Unit, 3> kTimeUnits{{{"min", 60.0}, {"s", 1.0}, {"h", 3600.0}}};

// Reads a number with one of the units, and returns it in the SI unit.
std::optional<double> measure(std::string_view word, std::span<const Unit> units) {
    for (const Unit& unit : units) {
        if (!word.ends_with(unit.name)) continue;
        std::string_view digits = word.substr(0, word.size() - unit.name.size());
        while (digits.ends_with(' ')) digits.remove_suffix(1);  // "40 mm", as printed
        const auto number = whole_word<double>(digits);
        if (!number || !std::isfinite(*number)) return std::nullopt;
        return *number * unit.size;
    }
    return std::nullopt;
}

std::optional<double> metres(std::string_view word) {
    return measure(word, kLengthUnits);
}

// Splits "AxB" into A and B.
std::optional<std::pair<std::string_view, std::string_view>> halves(std::string_view word) {
    const std::size_t cross = word.find_first_of("xX");
    if (cross == std::string_view::npos) return std::nullopt;
    return std::pair{word.substr(0, cross), word.substr(cross + 1)};
}

}  // namespace

double parse_number(const Location& at, std::string_view word, double least, double most) {
    const auto value = whole_word<double>(word);
    if (!value || !(*value >= least && *value <= most)) {  // false for NaN
        input_error(at, "\"{}\" is not accepted; expected a number from {:g} to {:g}", one_line(word), least,
                    most);
    }
    return *value;
}

std::int64_t parse_whole(const Location& at, std::string_view word, std::int64_t least, std::int64_t most) {
    const auto value = whole_word<std::int64_t>(word);
    if (!value || *value < least || *value > most) {
        input_error(at, "\"{}\" is not accepted; expected a whole number from {} to {}", one_line(word),
                    least, most);
    }
    return *value;
}

std::uint64_t parse_seed(const Location& at, std::string_view word) {
    const auto value = whole_word<std::uint64_t>(word);
    if (!value)
        input_error(at, "\"{}\" is not accepted; expected a whole number from 0 to {}", one_line(word),
                    UINT64_MAX);
    return *value;
}

double parse_length(const Location& at, std::string_view word) {
    const auto value = metres(word);
    if (!value || !(*value > 0)) {
        input_error(
            at, "\"{}\" is not a length; expected a positive number with a unit, for example 40mm, 4cm, 1.2m",
            one_line(word));
    }
    return *value;
}

double parse_place(const Location& at, std::string_view word) {
    const auto value = word == "0" ? 0.0 : metres(word);
    if (!value)
        input_error(at, "\"{}\" is not a position; expected a number with a unit, for example -2mm, 0, 1.2cm",
                    one_line(word));
    return *value;
}

double parse_metres(const Location& at, std::string_view word, double least, double most) {
    auto value = metres(word);
    if (!value) value = metres(std::string(word) + "m");
    if (!value || !(*value >= least && *value <= most)) {
        input_error(at,
                    "\"{}\" is not accepted; expected {:g} to {:g} metres, or a number with um, mm, cm or m",
                    one_line(word), least, most);
    }
    return *value;
}

Imath::V2d parse_length_pair(const Location& at, std::string_view word) {
    const auto parts = halves(word);
    const auto x = parts ? metres(parts->first) : std::nullopt;
    const auto y = parts ? metres(parts->second) : std::nullopt;
    if (!x || !y || !(*x > 0) || !(*y > 0)) {
        input_error(at, "\"{}\" is not a size; expected two positive lengths, for example 20mmx10mm",
                    one_line(word));
    }
    return {*x, *y};
}

V2i parse_size(const Location& at, std::string_view word, int most) {
    const auto parts = halves(word);
    const auto x = parts ? whole_word<int>(parts->first) : std::nullopt;
    const auto y = parts ? whole_word<int>(parts->second) : std::nullopt;
    if (!x || !y || *x < 1 || *y < 1 || *x > most || *y > most) {
        input_error(at, "\"{}\" is not a size; expected two whole numbers from 1 to {}, for example 64x48",
                    one_line(word), most);
    }
    return {*x, *y};
}

double parse_duration(const Location& at, std::string_view word) {
    const auto value = measure(word, kTimeUnits);
    if (!value || !(*value > 0) || !std::isfinite(*value)) {
        input_error(
            at, "\"{}\" is not a time; expected a number greater than 0 with s, min or h, for example 30s",
            one_line(word));
    }
    return *value;
}

double parse_share(const Location& at, std::string_view word) {
    const bool percent = word.ends_with('%');
    const auto number = whole_word<double>(percent ? word.substr(0, word.size() - 1) : word);
    const double share = number ? *number / (percent ? 100 : 1) : 0;
    if (!(share > 0 && share <= 1)) {  // false for NaN
        input_error(at, "\"{}\" is not a share; expected more than 0 and at most 1, for example 0.99 or 99%",
                    one_line(word));
    }
    return share;
}

Rgb parse_colour(const Location& at, std::string_view word) {
    Rgb colour(0);
    std::string_view rest = word;
    bool good = true;
    for (int c = 0; c < 3; ++c) {
        const std::size_t comma = c < 2 ? rest.find(',') : rest.size();
        const auto value =
            comma == std::string_view::npos ? std::nullopt : whole_word<float>(rest.substr(0, comma));
        good = value && *value >= 0 && *value <= 1e6F;  // false for NaN
        if (!good) break;
        colour[c] = *value;
        rest.remove_prefix(std::min(rest.size(), comma + 1));
    }
    if (!good || !(luminance(colour) > 1e-6F)) {
        input_error(
            at, "\"{}\" is not a colour; expected red, green and blue, each 0 or more, for example 1,0.8,0.5",
            one_line(word));
    }
    return colour / luminance(colour);  // above 1e-6
}

std::pair<std::string, std::string> parse_assignment(const Location& at, std::string_view word) {
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos || equals == 0 || equals + 1 == word.size()) {
        input_error(at, "\"{}\" is not accepted; expected key=value, for example --set photons=200000",
                    one_line(word));
    }
    return {std::string(word.substr(0, equals)), std::string(word.substr(equals + 1))};
}

std::string length_text(double metres_) {
    const double size = std::fabs(metres_);
    if (size == 0) return "0";
    if (size < 1e-3) return fmt::format("{:.4g} um", metres_ * 1e6);
    if (size < 1) return fmt::format("{:.4g} mm", metres_ * 1e3);
    return fmt::format("{:.4g} m", metres_);
}

std::string duration_text(double seconds) {
    if (seconds < 0.01) return "<0.01 s";
    if (seconds < 9.95) return fmt::format("{:.2g} s", seconds);
    if (seconds < 59.5) return fmt::format("{:.0f} s", seconds);
    const auto whole = static_cast<std::int64_t>(std::llround(std::min(seconds, 1e12)));
    if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
    return fmt::format("{} h {} min", whole / 3600, whole / 60 % 60);
}

std::string percent_text(double share) {
    const double percent = 100 * share;
    if (!(std::fabs(percent) < 10)) return fmt::format("{:.0f} %", percent);
    if (std::fabs(percent) >= 1e-4 || percent == 0) return fmt::format("{:.2g} %", percent);
    const int places = 1 - static_cast<int>(std::floor(log10(std::fabs(percent))));
    return fmt::format("{:.{}f} %", percent, places);
}

std::string bytes_text(double bytes) {
    if (bytes < 1e3) return fmt::format("{:.0f} bytes", bytes);
    if (bytes < 1e6) return fmt::format("{:.3g} kB", bytes / 1e3);
    if (bytes < 1e9) return fmt::format("{:.3g} MB", bytes / 1e6);
    if (bytes < 1e12) return fmt::format("{:.3g} GB", bytes / 1e9);
    return fmt::format("{:.3g} TB", bytes / 1e12);
}

}  // namespace lucerna
