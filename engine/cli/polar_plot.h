// The luminous intensity distribution as lighting people draw it: a polar diagram of two planes, as SVG.
#pragma once

#include <string>
#include <string_view>

#include "lights/photometric.h"

namespace lucerna {

// Nadir is down; the plane C0-C180 is solid, C90-C270 dashed; the half without light is left away. `unit` is
// that of the intensities, "cd" or "W/sr", `flux_unit` that of the flux.
std::string polar_plot_svg(const PhotometricWeb& web, std::string_view title, std::string_view unit,
                           std::string_view flux_unit);

}  // namespace lucerna
