// Loop subdivision: a coarse mesh of triangles to points and normals of its limit surface.
#pragma once

#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

struct LoopMesh {
    std::vector<V3d> p, n;  // n unit, on the side of the triangles' own normals
    std::vector<V3i> triangles;
};

// Each level cuts every triangle into four. Boundaries are creases (pbrt's rule, too). Throws InputError for
// what is no surface: a triangle that names a vertex twice, an edge of more than two triangles.
LoopMesh subdivide_loop(const std::vector<V3d>& p, const std::vector<V3i>& triangles, int levels);

}  // namespace lucerna
