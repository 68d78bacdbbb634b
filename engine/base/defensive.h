// The share of plain sampling in every mixture with a learned density.
#pragma once

namespace lucerna {

// Defensive mixture weight [Hesterberg 1995]: the least share of the plain density, so that no sample weighs
// more than four times what it would without the learned one. Shares from 0.1 to 0.5 differ by less than
// their noise in the measured scenes (docs/results/results.md).
inline constexpr float kDefensiveWeight = 0.25F;

}  // namespace lucerna
