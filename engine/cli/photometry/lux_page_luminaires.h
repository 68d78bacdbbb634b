// The sections of a report on luminaires: their types and data sheets, the power that they need, and their
// places.
#pragma once

#include <string>

#include "engine/cli/photometry/lux_page.h"

namespace lucerna {

// Rounds to multiples of 1 / `parts`, without -0.
double rounded(double x, double parts);
// Formats a vector to two decimals.
std::string point_text(const V3d& point);
// Formats a unit vector to two decimals; 0 is a dash.
std::string direction_text(const V3d& axis);

// Return HTML.
std::string luminaires_section(const IlluminanceReport& report, const LuxPage& page);
// Empty if there is no room.
std::string energy_section(const IlluminanceReport& report, const LuxPage& page);
// Lists where the luminaires are and to where they shine.
std::string places_section(const IlluminanceReport& report, const LuxPage& page);

}  // namespace lucerna
