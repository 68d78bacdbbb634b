#include "engine/scene/texture_mapping.h"

namespace lucerna {
namespace {

double finite(double x) {
    return std::isfinite(x) ? x : 0.0;
}

// The maps are affine: the reader sees to it.
V3d moved(const M44d& m, const V3d& p) {
    return {p.x * m[0][0] + p.y * m[1][0] + p.z * m[2][0] + m[3][0],
            p.x * m[0][1] + p.y * m[1][1] + p.z * m[2][1] + m[3][1],
            p.x * m[0][2] + p.y * m[1][2] + p.z * m[2][2] + m[3][2]};
}

struct Map {
    const TexturePoint& point;

    V2d operator()(const UvMapping& m) const {
        return {
            static_cast<double>(point.uv.x) * static_cast<double>(m.scale.x) + static_cast<double>(m.delta.x),
            static_cast<double>(point.uv.y) * static_cast<double>(m.scale.y) +
                static_cast<double>(m.delta.y)};
    }
    V2d operator()(const SphericalMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        // atan2 has an answer everywhere, at the poles and the origin too.
        const double phi = std::atan2(p.y, p.x);
        return {std::atan2(std::hypot(p.x, p.y), p.z) / kPiD, (phi < 0 ? phi + 2 * kPiD : phi) / (2 * kPiD)};
    }
    V2d operator()(const CylindricalMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        return {(kPiD + std::atan2(p.y, p.x)) / (2 * kPiD), p.z};
    }
    V2d operator()(const PlanarMapping& m) const {
        const V3d p = moved(m.texture_from_world, point.p);
        return {m.delta.x + p.dot(m.v1), m.delta.y + p.dot(m.v2)};
    }
};

}  // namespace

V2d texture_st(const Mapping2& mapping, const TexturePoint& point) {
    const V2d st = std::visit(Map{point}, mapping);
    return {finite(st.x), finite(st.y)};
}

V3d texture_position(const Mapping3& mapping, const TexturePoint& point) {
    const V3d p = moved(mapping.texture_from_world, point.p);
    return {finite(p.x), finite(p.y), finite(p.z)};
}

}  // namespace lucerna
