// Vectors, matrices and colours: Imath's, under short names. Nothing here is home-made but luminance.
#pragma once

#include <Imath/ImathBox.h>
#include <Imath/ImathColor.h>
#include <Imath/ImathMatrix.h>
#include <Imath/ImathVec.h>

#include <cmath>

namespace lucerna {

using Imath::V2f;
using Imath::V2i;
using Imath::V3d;
using Imath::V3f;
using Imath::V3i;
using M44d = Imath::M44d;
using M33f = Imath::M33f;
using Box3f = Imath::Box3f;
using Box3d = Imath::Box3d;

// Linear colour on the Rec. 709 / sRGB primaries. The unit is said where it is used.
using Rgb = Imath::Color3<float>;

inline constexpr float kPi = 3.14159265358979323846F;
inline constexpr double kPiD = 3.14159265358979323846;
inline constexpr float kInvPi = 0.31830988618379067154F;
inline constexpr double kRadiansPerDegree = kPiD / 180;

// The measure by which photons are counted, lights chosen and roulette played: Rec. 709 luminance.
inline float luminance(const Rgb& c) {
    return 0.212671F * c.x + 0.715160F * c.y + 0.072169F * c.z;
}

inline float max_component(const Rgb& c) {
    return std::fmax(c.x, std::fmax(c.y, c.z));
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

inline float sqr(float x) {
    return x * x;
}
inline double sqr(double x) {
    return x * x;
}

// A half-line. `d` has unit length; what lies beyond `t_max` (scene units) is not met.
struct Ray {
    V3f o, d;
    float t_max = INFINITY;

    V3f at(float t) const { return o + t * d; }
};

}  // namespace lucerna
