// What an error of luminance is relative to, wherever it is told as a share.
#pragma once

#include "engine/base/vec.h"

namespace lucerna {

// Of the image's mean luminance, so that the errors of black pixels do not count for more than they show.
inline constexpr double kErrorFloorShare = 0.1;

// The square of it: of the luminance there, and of that share of the image's mean. Above 0 in any image that
// is not black.
inline double error_scale2(double luminance, double mean) {
    return sqr(luminance) + sqr(kErrorFloorShare * mean);
}

}  // namespace lucerna
