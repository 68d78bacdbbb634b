// A mesh as a file contains it, or as a program passes it beside the scene's text.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// An untransformed mesh, in object space. `n` and `uv` are empty or have one entry per vertex.
struct ObjectMesh {
    std::vector<V3d> p, n;
    std::vector<V2f> uv;
    std::vector<V3i> triangles;
};

// Meshes in memory, by the names that Shape "arraymesh" uses in the text.
using NamedMeshes = std::map<std::string, std::shared_ptr<const ObjectMesh>, std::less<>>;

}  // namespace lucerna
