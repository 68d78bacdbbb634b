// Tells whether two images have the same colours, bit for bit.
#pragma once

#include "engine/image/image.h"

namespace lucerna::testing {

inline bool same(const Image& a, const Image& b) {
    for (int y = 0; y < a.height; ++y) {
        for (int x = 0; x < a.width; ++x) {
            if (a.rgb_at(x, y) != b.rgb_at(x, y)) return false;
        }
    }
    return true;
}

}  // namespace lucerna::testing
