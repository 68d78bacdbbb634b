// Bump maps and normal maps change the shading normal without moving the surface [Blinn 1978].
#include <array>
#include <cmath>

#include "engine/scene/material.h"
#include "engine/scene/scene.h"

namespace lucerna {
namespace {

// This is the step of the differences in u and v, as in pbrt where the pixel's footprint is unknown.
constexpr float kStep = 0.0005F;
// A normal that faces away from wo is bent until its product with wo, before it is normalised, is this share
// of the geometric normal's.
constexpr float kLeastCosine = 0.1F;

V3f across(const V3f& v, const V3f& n) {
    return v - n.dot(v) * n;
}

// Displacement p' = p + d n gives dp'/du = dp/du + dd/du n, and likewise along v. The term of d times the
// normal's derivative is omitted: it tilts the normal by the order of d over the radius of curvature.
V3f displaced_normal(const FloatTexture& displacement, const Hit& hit, const TexturePoint& point) {
    const auto stepped = [&](const V2f& step, const V3f& tangent) {
        return TexturePoint(point.uv + step, point.p + V3d(tangent * kStep));
    };
    const std::array<TexturePoint, 3> points{point, stepped({kStep, 0}, hit.dpdu),
                                             stepped({0, kStep}, hit.dpdv)};
    std::array<float, 3> heights{};
    displacement.at_each(points, heights);
    const float slope_u = (heights[1] - heights[0]) / kStep, slope_v = (heights[2] - heights[0]) / kStep;
    const V3f u = across(hit.dpdu, hit.ns) + slope_u * hit.ns;
    const V3f v = across(hit.dpdv, hit.ns) + slope_v * hit.ns;
    return u.cross(v);
}

V3f mapped_normal(const RgbTexture& normals, const Hit& hit, const TexturePoint& point) {
    const Rgb stored = normals.at(point);
    const V3f along = across(hit.dpdu, hit.ns);
    const float length = along.length();
    if (!(length > 0)) return hit.ns;
    const V3f s = along / length;
    return (2 * stored.x - 1) * s + (2 * stored.y - 1) * hit.ns.cross(s) + (2 * stored.z - 1) * hit.ns;
}

// Keeps the surface facing wo: bends the normal towards ng, which is on wo's side, until wo is above its
// plane.
V3f facing(const V3f& n, const V3f& ng, const V3f& wo) {
    const float cos_g = ng.dot(wo);
    const float side = cos_g >= 0 ? 1.0F : -1.0F;
    const float lacking = kLeastCosine * std::fabs(cos_g) - side * n.dot(wo);
    if (!(lacking > 0)) return n;
    if (cos_g == 0) return ng;
    return (n + (lacking / std::fabs(cos_g)) * ng).normalized();
}

}  // namespace

V3f bent_normal(const Relief& relief, const Hit& hit, const TexturePoint& point) {
    V3f n = relief.displacement ? displaced_normal(*relief.displacement, hit, point)
            : relief.normals    ? mapped_normal(*relief.normals, hit, point)
                                : hit.ns;
    const float length = n.length();
    if (!(length > 0) || !std::isfinite(length)) return hit.ns;
    n /= length;
    // The parametrisation determines the direction of u × v, so that it may point to either side.
    if (n.dot(hit.ns) < 0) n = -n;
    const float cos_g = n.dot(hit.at.n);
    if (cos_g < 0) n = (n - 2 * cos_g * hit.at.n).normalized();  // reflect it into ng's hemisphere
    return facing(n, hit.at.n, hit.wo);
}

}  // namespace lucerna
