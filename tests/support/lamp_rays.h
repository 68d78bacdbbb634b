// Directions of rays that tests make of lamps by formula.
#pragma once

#include "engine/base/vec.h"
#include "engine/base/warp.h"

namespace lucerna::testing {

// By Lambert's law about a unit normal: the normal and a point of the unit sphere, added; a little less than
// all of it, as the sum must not vanish.
inline V3d lambertian(const V3d& normal, const V2f& u) {
    return (normal + 0.999999 * V3d(square_to_sphere(u))).normalized();
}

}  // namespace lucerna::testing
