// What an error of luminance is relative to, wherever it is told as a share.
#pragma once

#include "engine/base/vec.h"

namespace lucerna {

// The square of it: of the luminance there and of a tenth of the image's mean, so that the errors of black
// pixels do not count for more than they show. Above 0 in any image that is not black.
inline double error_scale2(double luminance, double mean) {
    return sqr(luminance) + sqr(0.1 * mean);
}

}  // namespace lucerna
