// Describes how a surface's shading normal changes along it.
#pragma once

#include "engine/base/vec.h"

namespace lucerna {

// Carries a normal, of any length, from a frame to which `to_local` leads: by the inverse transpose, which
// with row vectors p' = p A is n' = A⁻¹ n.
inline V3d carried_normal(const M44d& to_local, const V3d& n) {
    V3d out;
    for (int i = 0; i < 3; ++i) out[i] = to_local[i][0] * n.x + to_local[i][1] * n.y + to_local[i][2] * n.z;
    return out;
}

// Multiplies a matrix by a column vector.
inline V3d times(const Imath::M33d& m, const V3d& v) {
    return {V3d(m[0][0], m[0][1], m[0][2]).dot(v), V3d(m[1][0], m[1][1], m[1][2]).dot(v),
            V3d(m[2][0], m[2][1], m[2][2]).dot(v)};
}

// Describes a field of vectors along a surface's shading normals, at one place: its value, of any length, and
// its derivative by the position.
struct NormalField {
    V3d value{0, 0, 1};
    Imath::M33d by_position{0, 0, 0, 0, 0, 0, 0, 0, 0};  // times a step in space, a column vector

    // Returns the field in a frame from which `to_local` leads to the present one.
    NormalField in_frame(const M44d& to_local) const {
        Imath::M33d b;
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) b[i][j] = to_local[i][j];
        }
        return {carried_normal(to_local, value), b * by_position * b.transposed()};
    }
    // Returns the change of the field's unit vector for a step along the surface. The value is not 0.
    V3d unit_change(const V3d& step) const {
        const double length = value.length();
        const V3d n = value / length, change = times(by_position, step) / length;
        return change - n.dot(change) * n;
    }
};

}  // namespace lucerna
