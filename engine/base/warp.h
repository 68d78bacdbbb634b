// Defines warps of the unit square with their densities and inverses, which a test checks against each other.
#pragma once

#include <algorithm>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {

// Maps to the unit disc, area-preserving and continuous [Shirley and Chiu 1997]. Density 1/pi.
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
    return {r * cos(phi), r * sin(phi)};
}

// Returns the inverse for a point of the unit disc, or just outside it by rounding.
inline V2f disc_to_square(const V2f& p) {
    const float r = std::sqrt(p.x * p.x + p.y * p.y);
    if (r == 0) return {0.5F, 0.5F};
    const float x = std::fabs(p.x), y = std::fabs(p.y);
    // This is the angle within a wedge of 90 degrees around an axis, divided by a quarter of pi.
    const float share = atan2(std::min(x, y), std::max(x, y)) * (4 * kInvPi);
    const V2f c = x > y ? V2f(std::copysign(r, p.x), std::copysign(r * share, p.y))
                        : V2f(std::copysign(r * share, p.x), std::copysign(r, p.y));
    return {std::clamp(0.5F * (c.x + 1), 0.0F, 1.0F), std::clamp(0.5F * (c.y + 1), 0.0F, 1.0F)};
}

// Maps to the upper hemisphere about +z with density cos/pi (Malley).
inline V3f square_to_cosine_hemisphere(const V2f& u) {
    const V2f p = square_to_disc(u);
    return {p.x, p.y, std::sqrt(std::max(0.0F, 1.0F - p.x * p.x - p.y * p.y))};
}
inline float cosine_hemisphere_pdf_w(float cos_theta) {
    return std::max(0.0F, cos_theta) * kInvPi;
}

// Maps to the unit sphere with density 1/(4 pi): the upper hemisphere is in the square's inner diamond, the
// lower one in its corners [Clarberg 2008]. Unlike with polar coordinates, neighbouring numbers of 24 bits
// are neighbouring directions everywhere, at the poles too, where lamps shine straight down. Coordinates
// slightly outside the square (from a pixel filter) wrap around its edges.
inline V3f square_to_sphere(V2f at) {
    if (at.x < 0) at = {-at.x, 1 - at.y};
    if (at.x > 1) at = {2 - at.x, 1 - at.y};
    if (at.y < 0) at = {1 - at.x, -at.y};
    if (at.y > 1) at = {1 - at.x, 2 - at.y};
    const float u = 2 * at.x - 1, v = 2 * at.y - 1;
    const float inside = 1 - (std::fabs(u) + std::fabs(v));  // signed distance from the diamond's edge
    const float r = 1 - std::fabs(inside);
    const float phi = (r == 0 ? 1 : (std::fabs(v) - std::fabs(u)) / r + 1) * kPi / 4;
    const float across = r * std::sqrt(std::max(0.0F, 2 - r * r));
    return {std::copysign(cos(phi), u) * across, std::copysign(sin(phi), v) * across,
            std::copysign(1 - r * r, inside)};
}
inline constexpr float kSpherePdfW = 0.25F * kInvPi;

// Maps to a cone about +z, uniformly in solid angle. 1 - cosine of the half-angle keeps thin cones accurate.
inline V3f square_to_cone(const V2f& u, float one_minus_cos_max) {
    const float h = u.x * one_minus_cos_max;  // 1 - cos
    const float r = std::sqrt(std::max(0.0F, h * (2 - h)));
    const float phi = 2 * kPi * u.y;
    return {r * cos(phi), r * sin(phi), 1 - h};
}
inline float cone_pdf_w(float one_minus_cos_max) {
    return 1.0F / (2 * kPi * one_minus_cos_max);
}

// Returns the barycentric weights of a triangle's second and third vertex, uniform in area.
inline V2f square_to_triangle(const V2f& u) {
    const float root = std::sqrt(u.x);
    return {root * (1 - u.y), root * u.y};
}

}  // namespace lucerna
