// The median of a small window of an image: a smooth background, without the single pixels that stand out of
// it.
#pragma once

#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

// The median of the 5 x 5 window around each pixel (row-major, finite). At the border the window is what lies
// inside the image; of an even number it is the mean of the two in the middle.
std::vector<float> median_5x5(std::span<const float> image, const V2i& size, const Workers& workers);

// The same at one pixel, of those of its neighbours (and itself) that `good` accepts by their index;
// `fallback` if it accepts none.
template <typename Good>
float median_around(std::span<const float> image, const V2i& size, const V2i& at, float fallback,
                    Good&& good);

// The median of values, which are reordered; 0 of none.
float median_of(std::span<float> values);

template <typename Good>
float median_around(std::span<const float> image, const V2i& size, const V2i& at, float fallback,
                    Good&& good) {
    float window[25];
    std::size_t count = 0;
    for (int y = std::max(at.y - 2, 0); y <= std::min(at.y + 2, size.y - 1); ++y) {
        for (int x = std::max(at.x - 2, 0); x <= std::min(at.x + 2, size.x - 1); ++x) {
            const std::size_t i =
                static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) + static_cast<std::size_t>(x);
            if (good(i)) window[count++] = image[i];
        }
    }
    return count == 0 ? fallback : median_of({window, count});
}

}  // namespace lucerna
