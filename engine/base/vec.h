// Defines vectors, matrices and colours (Imath's, under short names), rays, frames, boxes and surface points.
#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace lucerna {

using Imath::V2f;
using Imath::V2i;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using M44d = Imath::M44d;
using M33f = Imath::M33f;
using Box2f = Imath::Box2f;
using Box3f = Imath::Box3f;
using Box3d = Imath::Box3d;

// Holds a linear colour, light or ratio of the working space (working_space.h). The unit is stated at its
// use.
using Rgb = Imath::Color3<float>;

inline constexpr float kPi = 3.14159265358979323846F;
inline constexpr double kPiD = 3.14159265358979323846;
// The largest numbers below 1, the end of the range of uniform numbers.
inline constexpr float kBelowOne = 0x1.fffffep-1F;
inline constexpr double kBelowOneD = 0x1.fffffffffffffp-1;
inline constexpr float kInvPi = 0.31830988618379067154F;
inline constexpr double kRadiansPerDegree = kPiD / 180;

// Returns the weight of light in any working space, for counting photons, choosing lights and Russian
// roulette.
inline float luminance(const Rgb& c) {
    return 0.212671F * c.x + 0.715160F * c.y + 0.072169F * c.z;
}

inline float max_component(const Rgb& c) {
    return std::fmax(c.x, std::fmax(c.y, c.z));
}
inline Rgb at_most_one(const Rgb& c) {
    return {std::min(c.x, 1.0F), std::min(c.y, 1.0F), std::min(c.z, 1.0F)};
}
inline bool is_black(const Rgb& c) {
    return c.x == 0 && c.y == 0 && c.z == 0;
}
inline bool is_finite(const Rgb& c) {
    return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z);
}
inline bool is_finite(const V3f& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Returns v.normalized(), bit for bit, without Imath's function call except for the rare very short vectors.
template <typename T>
Imath::Vec3<T> unit(const Imath::Vec3<T>& v) {
    const T length2 = v.length2();
    if (length2 < 2 * std::numeric_limits<T>::min()) [[unlikely]]
        return v.normalized();
    const T length = std::sqrt(length2);
    return {v.x / length, v.y / length, v.z / length};
}

// Returns n or -n, whichever is on w's side [Pharr et al. 2023, 3.3: FaceForward]; n if w is in its plane.
template <typename T>
Imath::Vec3<T> face_forward(const Imath::Vec3<T>& n, const Imath::Vec3<T>& w) {
    return n.dot(w) < 0 ? -n : n;
}

constexpr float sqr(float x) {
    return x * x;
}
constexpr double sqr(double x) {
    return x * x;
}

// Represents a half-line. `d` has unit length; nothing beyond `t_max` (scene units) is met.
struct Ray {
    V3f o, d;
    float t_max = INFINITY;

    V3f at(float t) const { return o + t * d; }
};

// Represents an orthonormal frame around a unit normal, which is local z.
struct Frame {
    V3f s, t, n;

    Frame() : s(1, 0, 0), t(0, 1, 0), n(0, 0, 1) {}

    // Uses [Duff 2017], which has no branch but the sign and is accurate for every n.
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

inline constexpr int kBoxCorners = 8;

inline V3d box_corner(const Box3d& box, int i) {
    return {(i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
            (i & 4) != 0 ? box.max.z : box.min.z};
}

// Returns the box around the image of a box; empty for an empty box.
inline Box3d carried_box(const Box3d& box, const M44d& m) {
    Box3d out;
    if (box.isEmpty()) return out;
    for (int i = 0; i < kBoxCorners; ++i) {
        V3d to;
        m.multVecMatrix(box_corner(box, i), to);
        out.extendBy(to);
    }
    return out;
}

// A float has 24 bits; eight of its last units cover the rounding of one intersection and one transformation.
inline constexpr float kSurfaceUlps = 8 * 0x1p-23F;

// Returns a bound of the distance of `p` from the true surface. It is proportional to the largest coordinate
// and to the size of the primitive, because the intersection subtracts both.
inline float surface_error(const V3f& p, float primitive_extent) {
    const float largest = std::max(std::fabs(p.x), std::max(std::fabs(p.y), std::fabs(p.z)));
    return kSurfaceUlps * (largest + primitive_extent);
}

struct SurfacePoint {
    V3f p;            // scene units
    V3f n{0, 0, 0};   // geometric unit normal; zero where there is no surface (a point in space)
    float error = 0;  // scene units

    // Returns the point with its normal on w's side.
    SurfacePoint facing(const V3f& w) const { return {p, face_forward(n, w), error}; }
    // Returns the origin of a ray that leaves towards `w`, moved off the surface on w's side.
    V3f towards(const V3f& w) const { return p + std::copysign(error, n.dot(w)) * n; }
};

}  // namespace lucerna
