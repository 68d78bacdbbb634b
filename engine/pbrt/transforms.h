// pbrt's transformations, written once for Imath's row vectors.
//
// pbrt thinks in column vectors, p' = M p, and a new transformation is multiplied from the right: CTM = CTM ·
// M, so that the one written last is applied to the points first. Imath has p' = p · N with N = Mᵀ; then the
// same step is CTM = N · CTM. A pbrt file lists the sixteen numbers of Transform column by column, which is
// Mᵀ row by row: they go into an Imath matrix as they stand, with the translation in the last row.
#pragma once

#include <optional>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

// `local` is applied to points before `ctm`.
inline M44d then(const M44d& local, const M44d& ctm) {
    return local * ctm;
}

M44d translation(const V3d& by);
M44d scaling(const V3d& by);
// Right-handed about `axis` (not zero), degrees.
M44d rotation(double degrees, const V3d& axis);
// World to camera; none if eye and target coincide or `up` points along the view.
std::optional<M44d> look_at(const V3d& eye, const V3d& target, const V3d& up);
// pbrt's list of sixteen.
M44d matrix_of(std::span<const double> sixteen);

bool is_finite(const M44d& m);
// None if there is no inverse in double precision or m is not affine.
std::optional<M44d> inverse(const M44d& m);
bool swaps_handedness(const M44d& m);
// The factor if m is a rotation or reflection, a translation and one scale for all directions; to 1e-4.
std::optional<double> uniform_scale(const M44d& m);

V3d transform_point(const M44d& m, const V3d& p);
V3d transform_vector(const M44d& m, const V3d& v);
// `inverse_of_m` is the inverse of the map that moves the surface. Not normalised.
V3d transform_normal(const M44d& inverse_of_m, const V3d& n);

// The same map into coordinates relative to `origin`.
M44d relative_to(const M44d& world_from_local, const V3d& origin);

}  // namespace lucerna
