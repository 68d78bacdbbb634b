// Guth's position index as CIE 117 tabulates it, for UGR tables. Elsewhere the index is computed by a formula
// that was fitted to the same observations (position_index() of observer.h); both differ by 5 % (RMS).
#pragma once

#include <optional>

namespace lucerna {

// Returns the position index of a luminaire that is H above the eye, R ahead along the line of sight and T
// beside it, interpolated linearly in both ratios, each >= 0. Returns none where the table has no entry:
// beyond T/R = 3 and H/R = 1.9, and for high luminaires straight ahead. Such luminaires do not count in UGR.
// Source: CIE 117:1995, Table 4.1, as transcribed by [eulumdat-ugr 2026].
std::optional<double> tabulated_position_index(double t_over_r, double h_over_r);

}  // namespace lucerna
