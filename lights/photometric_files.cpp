#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "lights/photometric_files.h"

namespace lucerna {
namespace {

constexpr double kSame = 1e-6;  // degrees

bool same(double a, double b) {
    return std::fabs(a - b) < kSame;
}

// Appends the planes of the grid in falling order, each at `about` - its angle, except those on the mirrors.
void append_mirrored(PhotometricGrid& grid, double about) {
    const std::size_t planes = grid.azimuth.size(), angles = grid.polar.size();
    for (std::size_t i = planes; i-- > 0;) {
        const double mirrored = about - grid.azimuth[i];
        if (!(mirrored > grid.azimuth.back() + kSame)) continue;  // lies on the mirror itself
        grid.azimuth.push_back(mirrored);
        for (std::size_t j = 0; j < angles; ++j) grid.candela.push_back(grid.candela[i * angles + j]);
    }
}

// 90 to 270, mirrored about that plane: the other half lies at -90 to 90.
void prepend_front_half(PhotometricGrid& grid) {
    PhotometricGrid front{grid.planes, grid.polar, {}, {}};
    const std::size_t planes = grid.azimuth.size(), angles = grid.polar.size();
    for (std::size_t i = planes; i-- > 1;) {
        front.azimuth.push_back(180 - grid.azimuth[i]);
        for (std::size_t j = 0; j < angles; ++j) front.candela.push_back(grid.candela[i * angles + j]);
    }
    front.azimuth.insert(front.azimuth.end(), grid.azimuth.begin(), grid.azimuth.end());
    front.candela.insert(front.candela.end(), grid.candela.begin(), grid.candela.end());
    grid = std::move(front);
}

void append_plane_again(PhotometricGrid& grid, double at) {
    grid.azimuth.push_back(at);
    for (std::size_t j = 0; j < grid.polar.size(); ++j) grid.candela.push_back(grid.candela[j]);
}

}  // namespace

std::vector<TextLine> lines_of(std::string_view text) {
    std::vector<TextLine> lines;
    int number = 0;
    while (!text.empty()) {
        const std::size_t end = text.find_first_of("\r\n");
        lines.push_back({text.substr(0, end), ++number});
        if (end == std::string_view::npos) break;
        const bool two = text[end] == '\r' && end + 1 < text.size() && text[end + 1] == '\n';
        text.remove_prefix(end + (two ? 2 : 1));
    }
    return lines;
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kSpace = " \t\v\f\r\n";
    const std::size_t first = text.find_first_not_of(kSpace);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::string shown_value(std::string_view text) {
    constexpr std::size_t kMost = 60;
    std::string shown;
    for (const char c : text.substr(0, kMost)) shown += c >= 0x20 && c < 0x7f ? c : '?';
    return text.size() > kMost ? shown + "..." : shown;
}

std::optional<double> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
        return std::nullopt;
    return value;
}

void complete_c_planes(PhotometricGrid& grid, const Location& place) {
    const double first = grid.azimuth.front(), last = grid.azimuth.back();
    if (grid.azimuth.size() == 1) {
        grid.azimuth.front() = 0;
        return append_plane_again(grid, 360);
    }
    if (same(first, 90) && same(last, 270)) return prepend_front_half(grid);
    if (same(first, 0) && same(last, 90)) {
        append_mirrored(grid, 180);
        return append_mirrored(grid, 360);
    }
    if (same(first, 0) && same(last, 180)) return append_mirrored(grid, 360);
    if (same(last - first, 360)) return;
    // All around, but for the plane that would come twice.
    const double step = last - grid.azimuth[grid.azimuth.size() - 2];
    if (last > 180 && last - first < 360 && same(last + step, first + 360))
        return append_plane_again(grid, first + 360);
    input_error(place,
                "the planes go from {:g} to {:g} degrees; expected one plane, 0 to 90, 0 to 180, 90 to 270 "
                "or 0 to 360",
                first, last);
}

}  // namespace lucerna
