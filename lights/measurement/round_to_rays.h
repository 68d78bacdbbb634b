// Rounds the coefficients of a light field made from rays to fractions of a ray.
//
// A coefficient of such a field is a sum over rays and as noisy as their number, so digits below the largest
// share of a ray that one coefficient gets, about an eighth, tell nothing about the lamp. The light that
// rounding adds or takes is made up for by the next coefficients, as in error diffusion [Floyd and Steinberg
// 1976], so that sums over neighbouring coefficients, which is all that a surface receives, stay as they
// were. Few different values remain, which the file's compression makes about a third as large.
//
// No rounded coefficient is negative: what one should subtract is taken from the next positive ones.
// Particles are then drawn from just the field that is stored, and nothing is clamped.
#pragma once

#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

// Returns the field of the rays with coefficients that are multiples of a power of 2, which is within a
// factor of √2 of an eighth of a ray's flux over the volume of a cell; if rays differ, of the flux below
// which they carry a hundredth of all light. Large coefficients have the 11 bits of a half. Coefficients that
// are 0 stay so. They are visited pixel by pixel within a view, then view by view, so that the flux of each
// view is kept to within one multiple unless its coefficients are negative together, and that of the field in
// any case.
//
// The multiples of a coloured field are those of W. X, Y and Z are 0 where W is, and are rounded more finely
// elsewhere, so that light keeps its colour.
LightField rounded_to_rays(const LightField& field, const RaySet& rays);

}  // namespace lucerna
