// Directions of rays for lamps that tests define by formula.
#pragma once

#include "engine/base/vec.h"
#include "engine/base/warp.h"

namespace lucerna::testing {

// Returns a direction distributed by Lambert's law about a unit normal: the sum of the normal and a point of
// the unit sphere, which is scaled slightly below 1 so that the sum cannot vanish.
inline V3d lambertian(const V3d& normal, const V2f& u) {
    return (normal + 0.999999 * V3d(square_to_sphere(u))).normalized();
}

}  // namespace lucerna::testing
