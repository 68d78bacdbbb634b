// Drawings in SVG as pixels, through librsvg; part of the library of pictures.
#pragma once

#include <string>
#include <string_view>

#include "engine/image/pictures.h"

namespace lucerna {

// As Pictures::draw_svg says.
DrawnSvg draw_svg_by_librsvg(std::string_view svg, double scale, const std::string& font);

}  // namespace lucerna
