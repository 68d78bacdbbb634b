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

// Returns the angle in [0, 360), equal for all turns of a plane.
double within_a_turn(double angle) {
    const double turned = angle - 360 * std::floor(angle / 360);
    return same(turned, 360) ? 0 : turned;
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

std::string with_decimal_point(std::string_view word) {
    std::string text(word);
    std::replace(text.begin(), text.end(), ',', '.');
    return text;
}

bool may_separate_thousands(std::string_view word) {
    if (word.starts_with('-') || word.starts_with('+')) word.remove_prefix(1);
    const std::size_t comma = word.find(',');
    if (comma == std::string_view::npos || comma < 1 || comma > 3 || word.size() != comma + 4) return false;
    const auto digits = [](std::string_view part) {
        return std::all_of(part.begin(), part.end(), [](char c) { return c >= '0' && c <= '9'; });
    };
    return word.front() != '0' && digits(word.substr(0, comma)) && digits(word.substr(comma + 1));
}

void complete_c_planes(PhotometricGrid& grid, std::span<const double> mirrors) {
    // In `order`, listed planes precede their images, and images about the first mirror those about the
    // second.
    struct Plane {
        double angle;
        std::size_t order, listed;
    };
    std::vector<Plane> all_images;
    const auto add = [&all_images](double angle, std::size_t listed) {
        all_images.push_back({within_a_turn(angle), all_images.size(), listed});
    };
    for (std::size_t i = 0; i < grid.azimuth.size(); ++i) add(grid.azimuth[i], i);
    for (const double mirror : mirrors) {
        for (std::size_t i = 0, end = all_images.size(); i < end; ++i)
            add(2 * mirror - all_images[i].angle, all_images[i].listed);
    }
    std::sort(all_images.begin(), all_images.end(),
              [](const Plane& a, const Plane& b) { return a.angle < b.angle; });
    std::vector<Plane> planes;
    for (const Plane& plane : all_images) {
        if (planes.empty() || !same(plane.angle, planes.back().angle))
            planes.push_back(plane);
        else if (plane.order < planes.back().order)
            planes.back() = plane;
    }
    planes.push_back({planes.front().angle + 360, 0, planes.front().listed});

    PhotometricGrid all{grid.planes, std::move(grid.polar), {}, {}};
    for (const Plane& plane : planes) {
        all.azimuth.push_back(plane.angle);
        const auto row = grid.candela.begin() + static_cast<std::ptrdiff_t>(plane.listed * all.polar.size());
        all.candela.insert(all.candela.end(), row, row + static_cast<std::ptrdiff_t>(all.polar.size()));
    }
    grid = std::move(all);
}

void complete_ies_planes(PhotometricGrid& grid, const Location& place) {
    const double first = grid.azimuth.front(), last = grid.azimuth.back();
    if (grid.azimuth.size() == 1) {
        grid.azimuth.front() = 0;
        return complete_c_planes(grid, {});
    }
    constexpr double kBoth[] = {0, 90};
    const std::span<const double> both(kBoth), about_c0(kBoth, 1), about_c90(kBoth + 1, 1);
    if (same(first, 90) && same(last, 270)) return complete_c_planes(grid, about_c90);
    if (same(first, 0) && same(last, 90)) return complete_c_planes(grid, both);
    if (same(first, 0) && same(last, 180)) return complete_c_planes(grid, about_c0);
    if (same(last - first, 360)) return;
    // The planes go all around, except for the last one, which repeats the first.
    double widest = 0;
    for (std::size_t i = 1; i < grid.azimuth.size(); ++i)
        widest = std::max(widest, grid.azimuth[i] - grid.azimuth[i - 1]);
    const double open = 360 - (last - first);
    if (last - first > 180 && open > 0 && open <= widest + kSame) return complete_c_planes(grid, {});
    input_error(place,
                "the planes go from {:g} to {:g} degrees; expected one plane, 0 to 90, 0 to 180, 90 to 270 "
                "or 0 to 360",
                first, last);
}

}  // namespace lucerna
