#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/system/files.h"
#include "engine/text/plain_text.h"
#include "lights/photometric_files.h"

namespace lucerna {
namespace {

// Returns the signed width, length and height of LM-63-2002.
V3d signs_of_2002(const LuminousOpening& opening) {
    using Shape = LuminousOpening::Shape;
    const Shape shape = opening.shape;
    const auto sign = [](bool round) { return round ? -1.0 : 1.0; };
    const bool box = shape == Shape::box;
    return {sign(!box && shape != Shape::cylinder_along_c90) * opening.size.y,
            sign(!box && shape != Shape::cylinder_along_c0) * opening.size.x,
            sign(!box && shape != Shape::cylinder_upright) * opening.size.z};
}

// Lines hold ten numbers each; the format limits them to 132 characters.
template <typename Values>
void append_numbers(std::string& text, const Values& values) {
    constexpr std::size_t kPerLine = 10;
    std::size_t i = 0;
    for (const auto value : values) {
        text += fmt::format("{:.7g}", static_cast<double>(value));
        text += ++i % kPerLine == 0 || i == values.size() ? "\n" : " ";
    }
}

// Returns every plane from 0 to 360 once; the first and the last one are the same plane.
std::vector<double> planes_from_zero(const PhotometricGrid& grid) {
    std::vector<double> planes{0, 360};
    for (const double azimuth : grid.azimuth) planes.push_back(azimuth - 360 * std::floor(azimuth / 360));
    std::sort(planes.begin(), planes.end());
    planes.erase(std::unique(planes.begin(), planes.end(), [](double a, double b) { return b - a < 1e-6; }),
                 planes.end());
    return planes;
}

}  // namespace

std::string ies_text(const PhotometricWeb& given, std::string_view title) {
    const bool is_c = given.grid().planes == PhotometricPlanes::c;
    const PhotometricWeb web = is_c ? given : resampled({given}, 2.5, 5);
    const PhotometricGrid& grid = web.grid();
    const PhotometricInfo& info = web.info();
    // One plane suffices for a rotationally symmetric lamp.
    const bool round = std::equal(grid.candela.begin() + static_cast<std::ptrdiff_t>(grid.polar.size()),
                                  grid.candela.end(), grid.candela.begin());
    const std::vector<double> planes = round ? std::vector<double>{0} : planes_from_zero(grid);
    const std::string name = shown_value(one_line(title));
    const V3d opening = signs_of_2002(info.opening);

    std::string text = "IESNA:LM-63-2002\n";
    text += fmt::format(
        "[TEST] {0}\n[TESTLAB] not stated\n[ISSUEDATE] not stated\n[MANUFAC] not stated\n"
        "[LUMINAIRE] {0}\n[OTHER] absolute photometry, written by lucerna{1}\nTILT=NONE\n",
        name,
        info.smoothed > 0 ? fmt::format("; means over caps of {:g} degrees", info.smoothed) : std::string());
    text += fmt::format("1 -1 1 {} {} 1 2 {:.6g} {:.6g} {:.6g}\n1 1 {:g}\n", grid.polar.size(), planes.size(),
                        opening.x, opening.y, opening.z, info.watts);
    append_numbers(text, grid.polar);
    append_numbers(text, planes);
    for (const double c : planes) {
        std::vector<double> row;
        for (const double gamma : grid.polar) row.push_back(web.intensity(web.direction(gamma, c)));
        append_numbers(text, row);
    }
    return text;
}

void write_ies(const std::filesystem::path& file, const PhotometricWeb& web, std::string_view title) {
    const std::string text = ies_text(web, title);
    const std::span<const std::byte> bytes = std::as_bytes(std::span(text));
    replace_file(file, std::span(&bytes, 1));
}

}  // namespace lucerna
