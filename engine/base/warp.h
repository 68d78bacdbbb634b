// Warps of the unit square, each with its density and its inverse, so that a test can hold the three
// together.
#pragma once

#include <algorithm>

#include "engine/base/vec.h"

namespace lucerna {

// Unit disc, area-preserving and continuous (Shirley and Chiu 1997). Density 1/pi.
inline V2f square_to_disc(const V2f& u) {
    const V2f c = 2.0F * u - V2f(1, 1);
    if (c.x == 0 && c.y == 0) return {0, 0};
    float r = 0;
    float phi = 0;
    if (std::fabs(c.x) > std::fabs(c.y)) {
        r = c.x;
        phi = kPi / 4 * (c.y / c.x);
    } else {
        r = c.y;
        phi = kPi / 2 - kPi / 4 * (c.x / c.y);
    }
    return {r * std::cos(phi), r * std::sin(phi)};
}

// Upper hemisphere about +z, density cos/pi (Malley).
inline V3f square_to_cosine_hemisphere(const V2f& u) {
    const V2f p = square_to_disc(u);
    return {p.x, p.y, std::sqrt(std::max(0.0F, 1.0F - p.x * p.x - p.y * p.y))};
}
inline float cosine_hemisphere_pdf_w(float cos_theta) {
    return std::max(0.0F, cos_theta) * kInvPi;
}

// Unit sphere, density 1/(4 pi).
inline V3f square_to_sphere(const V2f& u) {
    const float z = 1 - 2 * u.x;
    const float r = std::sqrt(std::max(0.0F, 1 - z * z));
    const float phi = 2 * kPi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), z};
}
inline constexpr float kSpherePdfW = 0.25F * kInvPi;

// Cone about +z with half-angle of cosine `cos_max`; uniform in solid angle. `one_minus_cos` keeps thin cones
// exact.
inline V3f square_to_cone(const V2f& u, float one_minus_cos_max) {
    const float h = u.x * one_minus_cos_max;  // 1 - cos
    const float r = std::sqrt(std::max(0.0F, h * (2 - h)));
    const float phi = 2 * kPi * u.y;
    return {r * std::cos(phi), r * std::sin(phi), 1 - h};
}
inline float cone_pdf_w(float one_minus_cos_max) {
    return 1.0F / (2 * kPi * one_minus_cos_max);
}

// Barycentric weights of the second and third vertex of a triangle, uniform in area.
inline V2f square_to_triangle(const V2f& u) {
    const float root = std::sqrt(u.x);
    return {root * (1 - u.y), root * u.y};
}

}  // namespace lucerna
