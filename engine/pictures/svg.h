// Draws SVG as pixels by librsvg. This is part of the library of pictures.
#pragma once

#include <string>
#include <string_view>

#include "engine/image/pictures.h"

namespace lucerna {

// Implements Pictures::draw_svg. Throws std::runtime_error, in a build without librsvg always.
DrawnSvg draw_svg_by_librsvg(std::string_view svg, double scale, const std::string& font);

}  // namespace lucerna
