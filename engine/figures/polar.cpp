#include "engine/figures/polar.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/figures/false_colour.h"

namespace lucerna {
namespace {

constexpr double kStep = 2.5;  // degrees

// Returns the point at an angle from straight down, to the right for the first half planes (side 1).
Imath::V2d at(const Imath::V2d& centre, double radius, double angle, double side) {
    const double a = angle * kPiD / 180;
    return centre + radius * Imath::V2d(side * sin(a), cos(a));
}

}  // namespace

std::string polar_svg(const PolarFigure& figure) {
    constexpr int kMostRings = 4;
    constexpr double kMargin = 24;
    double most = 1e-9;
    for (int plane = 0; plane < 4; ++plane) {
        for (double angle = 0; angle <= 180; angle += kStep)
            most = std::max(most, figure.intensity(plane, angle));
    }
    const double step = round_step_from(most / kMostRings).value();
    const int rings = static_cast<int>(std::ceil(most / step * (1 - 1e-9)));
    const Imath::V2d centre(figure.width / 2);
    const double scale = (figure.width / 2 - kMargin) / (rings * step);

    std::string svg = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:g}\" height=\"{0:g}\" viewBox=\"0 0 {0:g} "
        "{0:g}\" "
        "font-family=\"DejaVu Sans, Verdana, sans-serif\" font-size=\"10\" fill=\"#000000\">\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n",
        figure.width);
    for (int ring = 1; ring <= rings; ++ring) {
        fmt::format_to(std::back_inserter(svg),
                       "<circle cx=\"{0:g}\" cy=\"{0:g}\" r=\"{1:.1f}\" fill=\"none\" stroke=\"#b0b0b0\"/>\n",
                       centre.x, ring * step * scale);
    }
    for (const double angle : {0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0}) {
        for (const double side : {1.0, -1.0}) {
            const double reach = rings * step * scale;
            const Imath::V2d end = at(centre, reach, angle, side);
            fmt::format_to(std::back_inserter(svg),
                           "<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"#d0d0d0\"/>\n", centre.x,
                           centre.y, end.x, end.y);
            const Imath::V2d label = at(centre, reach + 13, angle, side);
            if (angle < 180 && angle > 0)
                fmt::format_to(std::back_inserter(svg),
                               "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{:g}°</text>\n",
                               label.x, label.y + 4, angle);
        }
    }
    for (int pair = 0; pair < 2; ++pair) {
        std::string path;
        for (int side = 0; side < 2; ++side) {
            for (double angle = side == 0 ? 180 : 0; angle >= 0 && angle <= 180;
                 angle += side == 0 ? -kStep : kStep) {
                const double r = scale * figure.intensity(pair + 2 * side, angle);
                const Imath::V2d p = at(centre, r, angle, side == 0 ? 1 : -1);
                fmt::format_to(std::back_inserter(path), "{}{:.1f} {:.1f}", path.empty() ? "M" : "L", p.x,
                               p.y);
            }
        }
        fmt::format_to(
            std::back_inserter(svg),
            "<path class=\"polar\" d=\"{}Z\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{}/>\n", path,
            pair == 0 ? "#c00000" : "#0040a0", pair == 0 ? "" : " stroke-dasharray=\"5 3\"");
    }
    for (int ring = 1; ring <= rings; ++ring) {
        fmt::format_to(std::back_inserter(svg), "<text x=\"{:.1f}\" y=\"{:.1f}\">{:g}</text>\n", centre.x + 3,
                       centre.y + ring * step * scale - 3, ring * step);
    }
    fmt::format_to(
        std::back_inserter(svg),
        "<text x=\"4\" y=\"12\" font-weight=\"bold\">{}</text>\n"
        "<text x=\"4\" y=\"{:g}\" fill=\"#c00000\">C0–C180</text>\n"
        "<text x=\"{:g}\" y=\"{:g}\" text-anchor=\"end\" fill=\"#0040a0\">C90–C270</text>\n</svg>\n",
        figure.unit, figure.width - 5, figure.width - 4, figure.width - 5);
    return svg;
}

}  // namespace lucerna
