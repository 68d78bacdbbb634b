// Stands in for svg.cpp in a build without librsvg (CMakeLists.txt).
#include <stdexcept>

#include "engine/pictures/svg.h"

namespace lucerna {

DrawnSvg draw_svg_by_librsvg(std::string_view /*svg*/, double /*scale*/, const std::string& /*font*/) {
    throw std::runtime_error(
        "this build has no librsvg, which draws text; a file name that ends in .svg needs none");
}

}  // namespace lucerna
