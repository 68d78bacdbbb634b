// Intersects quadrics and disks under an affine map exactly, in double precision.
//
// A ray is transformed into object space and solved there in double, so that radii from 1e-6 to 1e6 and rays
// that start a few float32 units off the surface are handled alike.
#pragma once

#include <optional>

#include "engine/base/vec.h"
#include "engine/scene/mesh.h"
#include "engine/scene/normal_field.h"

namespace lucerna {

class QuadricShape {
  public:
    // Throws InputError for a radius, range or transformation without a surface (not > 0, empty, singular).
    explicit QuadricShape(const Quadric& quadric);

    // Returns the distance of the nearest crossing with t_min < t <= t_max, in units of d's length (not 0).
    std::optional<double> nearest(const V3d& o, const V3d& d, double t_min, double t_max) const;
    // Returns the nearest crossing with 0 < t <= ray.t_max.
    std::optional<double> nearest(const Ray& ray) const;

    struct Surface {
        V3d p;     // scene units, on the surface to double precision
        V3d n;     // unit, geometric; reverse_orientation applied
        V3d dpdu;  // pbrt's definition, not normalised, never zero
        V3d dpdv;  // pbrt's definition, not normalised, never zero
        V2f uv;    // pbrt's definition
    };
    // Returns the surface where the ray meets it at distance t, which must be nearest()'s result for this
    // ray.
    Surface at(const V3d& o, const V3d& d, double t) const;
    Surface at(const Ray& ray, double t) const;
    // Returns the surface at texture coordinates from 0 to 1.
    Surface at(double u, double v) const;

    // Returns the gradient of the shape's equation, which is along the normals, at a place on it (scene
    // units).
    NormalField normal_field(const V3d& p) const;

    // Returns bounds of the whole shape, rounded outwards.
    const Box3f& bounds() const { return bounds_; }
    // Returns bounds that are not rounded to float32.
    const Box3d& box() const { return box_; }
    // Returns the largest side of the bounds, scene units, which surface_error takes.
    float extent() const { return extent_; }

  private:
    struct Line {
        V3d o, d;      // object space, d unit
        double scale;  // object units per unit of t
    };
    // Describes a surface of revolution: x² + y² = a z² + 2 b z + c, with z relative to z_zero.
    struct Profile {
        double a = 0, b = 0, c = 0, z_zero = 0;
        double rest(const V3d& p) const;  // x² + y² minus the right-hand side
        V3d half_gradient(const V3d& p) const;
    };
    void check() const;
    void make_profile();
    Line to_object(const V3d& o, const V3d& d) const;
    double phi_at(const V3d& p) const;
    double v_at(const V3d& p) const;
    bool within(const V3d& p) const;
    std::optional<double> nearest_on_sphere(const Line& line, double s_min, double s_max) const;
    std::optional<double> nearest_on_disk(const Line& line, double s_min, double s_max) const;
    std::optional<double> nearest_on_profile(const Line& line, double s_min, double s_max) const;
    V3d normal_at(const V3d& p) const;
    V3d derivative_v(const V3d& p, double phi) const;
    Surface surface(const V3d& p, double phi, double v) const;
    Box3d compute_box() const;

    Quadric::Kind kind_;
    double radius_, inner_radius_, height_;  // object units
    V3d p1_, p2_;
    double z_min_, z_max_, phi_max_;  // z clamped to the shape
    bool whole_z_, whole_phi_;
    bool reverse_;
    Profile profile_;
    M44d world_from_object_, object_from_world_;
    Box3d box_;
    Box3f bounds_;
    float extent_ = 0;
};

}  // namespace lucerna
