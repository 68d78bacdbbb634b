// A point on a surface, with what is needed to leave that surface safely in float32.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/vec.h"

namespace lucerna {

// A float has 24 bits; eight of its last units cover what one intersection and one transform round away.
inline constexpr float kSurfaceUlps = 8 * 0x1p-23F;

// `error` bounds how far `p` may lie off the true surface: proportional to the largest coordinate and to the
// size of the primitive, because both are what the intersection subtracts.
inline float surface_error(const V3f& p, float primitive_extent) {
    const float largest = std::max(std::fabs(p.x), std::max(std::fabs(p.y), std::fabs(p.z)));
    return kSurfaceUlps * (largest + primitive_extent);
}

struct SurfacePoint {
    V3f p;            // scene units
    V3f n{0, 0, 0};   // geometric unit normal; zero where there is no surface (a point in space)
    float error = 0;  // scene units

    // The start of a ray that leaves towards `w`: moved off the surface on w's side.
    V3f towards(const V3f& w) const { return p + std::copysign(error, n.dot(w)) * n; }
};

}  // namespace lucerna
