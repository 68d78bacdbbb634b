// A polar diagram of a luminous intensity distribution, as data sheets show it.
#pragma once

#include <functional>
#include <string>

namespace lucerna {

struct PolarFigure {
    // Returns the intensity in the half plane 0 to 3 (C0, C90, C180, C270) at the angle from straight down
    // [degrees, 0 to 180], in `unit`; >= 0.
    std::function<double(int half_plane, double angle)> intensity;
    std::string unit = "cd/klm";
    double width = 300;  // pixels, >= 200; the figure is as high
};

// Returns one SVG element: C0-C180 as a solid line, C90-C270 as a dashed one, straight down at the bottom,
// with up to four circles of round values.
std::string polar_svg(const PolarFigure& figure);

}  // namespace lucerna
