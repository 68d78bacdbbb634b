// pbrt's transformations for Imath's row vectors.
//
// pbrt uses column vectors, p' = M p, and multiplies a new transformation from the right, CTM = CTM · M, so
// that the last one is applied to points first. Imath has p' = p · N with N = Mᵀ, where the same step is CTM
// = N · CTM. A pbrt file lists the sixteen numbers of Transform column by column, which is Mᵀ row by row, so
// they go into an Imath matrix unchanged, with the translation in the last row.
#pragma once

#include <optional>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

// Composes transformations; `local` is applied to points before `ctm`.
inline M44d then(const M44d& local, const M44d& ctm) {
    return local * ctm;
}

M44d translation(const V3d& by);
M44d scaling(const V3d& by);
// Rotates by degrees, right-handed about `axis`, which is not zero.
M44d rotation(double degrees, const V3d& axis);
// Returns world to camera, or nothing if eye and target coincide or `up` points along the view.
std::optional<M44d> look_at(const V3d& eye, const V3d& target, const V3d& up);
// Returns the matrix of pbrt's list of sixteen numbers.
M44d matrix_of(std::span<const double> sixteen);

bool is_finite(const M44d& m);
// Returns nothing if there is no inverse in double precision or m is not affine.
std::optional<M44d> inverse(const M44d& m);
bool swaps_handedness(const M44d& m);
// Returns the factor if m combines a rotation or reflection, a translation and a uniform scale, to 1e-4.
std::optional<double> uniform_scale(const M44d& m);

V3d transform_point(const M44d& m, const V3d& p);
V3d transform_vector(const M44d& m, const V3d& v);
// Transforms a normal without normalising it. `inverse_of_m` is the inverse of the map that moves the
// surface.
V3d transform_normal(const M44d& inverse_of_m, const V3d& n);

// Returns the same map into coordinates relative to `origin`.
M44d relative_to(const M44d& world_from_local, const V3d& origin);

}  // namespace lucerna
