// Computes the Hit at a place of a primitive: position, normals, tangents and texture coordinates, all in the
// frame of the shapes. The caller sets distance, material, light and media.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

#include "engine/base/vec.h"
#include "engine/scene/mesh.h"
#include "engine/scene/normal_field.h"
#include "engine/scene/quadric.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Describes a ray in a shape's frame; d may have any length.
struct LocalRay {
    V3d o, d;
    V3d at(double t) const { return o + t * d; }
};

// Describes the place where a ray meets the plane of a triangle: the weights of its second and third corner,
// clamped to the triangle if the ray passes beside the rim. There is none for a ray along the plane.
struct TrianglePoint {
    double t, b1, b2;
};
std::optional<TrianglePoint> triangle_point(const Mesh& mesh, std::uint32_t triangle, const LocalRay& ray);

V2f triangle_uv(const Mesh& mesh, std::uint32_t triangle, float b1, float b2);
Hit triangle_hit(const Mesh& mesh, std::uint32_t triangle, float b1, float b2);
// Writes the hit with its distance, at the exact place of the hit that Embree reports.
void triangle_hit(const Mesh& mesh, const PrimitiveHit& embrees, const LocalRay& ray, Hit& hit);

// Returns a positive t, because a ray may begin slightly behind a triangle's plane by rounding.
inline double ahead(double t) {
    return std::max(t, double{std::numeric_limits<float>::min()});
}

// Returns the interpolated normal before normalisation, or an even field where the mesh has none.
NormalField triangle_normal_field(const Mesh& mesh, std::uint32_t triangle, const PrimitiveHit& exact);

Hit quadric_hit(const QuadricShape& shape, const LocalRay& ray, double t);

V2f patch_uv(const BilinearMesh& mesh, std::uint32_t patch, double u, double v);
Hit patch_hit(const BilinearMesh& mesh, std::uint32_t patch, double u, double v);

// `u` is along the segment and `v` across it, as Embree defines them: -1 to 1 on a flat curve, 0 on a round
// one, 0 to 1 on a ribbon. `n` is Embree's normal, not unit.
V2f curve_uv(const Curves& curves, std::uint32_t segment, float u, float v);
struct CurvePoint {
    std::uint32_t segment;
    float u, v;
    V3f n;
};
Hit curve_hit(const Curves& curves, const CurvePoint& at, const LocalRay& ray, double t);

// Transforms rays and hits between a prototype's frame and the world by an affine map.
struct InstancePlacement {
    M44d to_world, to_local;
    float scale = 1;          // upper bound of a vector's lengthening
    float inverse_scale = 1;  // upper bound for the inverse map
    float reach = 0;          // length of to_local's translation, prototype units

    explicit InstancePlacement(const M44d& world_from_local);
    LocalRay local(const Ray& ray) const;
    Hit world(const Hit& hit) const;
};

// Holds a Bézier segment and its radii, in double.
struct CurveShape {
    V3d p[4];
    double r[4];

    CurveShape(const Curves& curves, std::size_t segment);
    V3d point(double u) const;
    V3d derivative(double u) const;  // never zero
    double radius(double u) const;
};

}  // namespace lucerna
