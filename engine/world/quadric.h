// Spheres and disks under an affine map, met exactly: what a ray needs of a Quadric, in double precision.
//
// A float32 ray is carried into object space and solved there in double, so radii from 1e-6 to 1e6 and rays
// that start a few float units off the surface are all alike.
#pragma once

#include <optional>

#include "engine/base/vec.h"
#include "engine/world/mesh.h"

namespace lucerna {

class QuadricShape {
  public:
    // Throws InputError for a radius, range or transformation that makes no surface (not > 0, empty,
    // singular).
    explicit QuadricShape(const Quadric& quadric);

    // Distance to the nearest crossing with 0 < t <= ray.t_max, scene units.
    std::optional<double> nearest(const Ray& ray) const;

    // The surface where the ray meets it at distance t (a value that nearest() returned for this very ray).
    struct Surface {
        V3d p;     // scene units, on the surface to double precision
        V3d n;     // unit, geometric; reverse_orientation applied
        V3d dpdu;  // pbrt's, not normalised, never zero
        V2f uv;    // pbrt's
    };
    Surface at(const Ray& ray, double t) const;

    // Holds the whole shape, rounded outwards.
    const Box3f& bounds() const { return bounds_; }
    // Largest side of the bounds, scene units: the size that surface_error asks for.
    float extent() const { return extent_; }

  private:
    struct Line {
        V3d o, d;      // object space, d unit
        double scale;  // object units per scene unit along the ray
    };
    Line to_object(const Ray& ray) const;
    bool within_phi(const V3d& p) const;
    std::optional<double> nearest_on_sphere(const Line& line, double s_max) const;
    std::optional<double> nearest_on_disk(const Line& line, double s_max) const;
    Box3f compute_bounds() const;

    Quadric::Kind kind_;
    double radius_, inner_radius_, height_;  // object units
    double z_min_, z_max_, phi_max_;         // z clamped to the sphere
    bool whole_z_, whole_phi_;
    bool reverse_;
    M44d world_from_object_, object_from_world_;
    Box3f bounds_;
    float extent_ = 0;
};

}  // namespace lucerna
