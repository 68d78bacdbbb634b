// Density kernels on the unit disc, each with integral 1 over the disc [Jensen 2001, 7]. `x2` is (d/r)², in
// [0,1].
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

enum class KernelShape : std::uint8_t { constant, cone, epanechnikov };

// What is done where an estimate's disc hangs over the edge of its surface; see boundary.h.
enum class Boundary : std::uint8_t { none, hull, probes };

inline float kernel(KernelShape shape, float x2) {
    switch (shape) {
        case KernelShape::constant:
            return kInvPi;
        case KernelShape::cone:
            return 3 * kInvPi * (1 - std::sqrt(x2));
        case KernelShape::epanechnikov:
            return 2 * kInvPi * (1 - x2);
    }
    return 0;
}

}  // namespace lucerna
