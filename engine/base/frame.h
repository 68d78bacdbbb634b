// An orthonormal frame around a unit normal; local z is the normal.
#pragma once

#include "engine/base/vec.h"

namespace lucerna {

struct Frame {
    V3f s, t, n;

    Frame() : s(1, 0, 0), t(0, 1, 0), n(0, 0, 1) {}

    // Duff et al., "Building an Orthonormal Basis, Revisited", 2017: no branch but the sign, good for every
    // n.
    explicit Frame(const V3f& normal) : n(normal) {
        const float sign = std::copysign(1.0F, n.z);
        const float a = -1.0F / (sign + n.z);  // |sign + n.z| >= 1
        const float b = n.x * n.y * a;
        s = V3f(1.0F + sign * n.x * n.x * a, sign * b, -sign * n.x);
        t = V3f(b, sign + n.y * n.y * a, -n.y);
    }

    V3f to_local(const V3f& v) const { return {v.dot(s), v.dot(t), v.dot(n)}; }
    V3f to_world(const V3f& v) const { return v.x * s + v.y * t + v.z * n; }
};

}  // namespace lucerna
