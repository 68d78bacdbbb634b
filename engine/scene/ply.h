// PLY files (Stanford polygon format), as pbrt's plymesh reads them.
#pragma once

#include <filesystem>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// `n` and `uv` are empty or have one entry per vertex; every index is one of a vertex.
struct PlyMesh {
    std::vector<V3f> p;  // the file's units
    std::vector<V3f> n;
    std::vector<V2f> uv;
    std::vector<V3i> triangles;
};

// ASCII or binary of either byte order. Vertex x y z, with nx ny nz and u v (or s t, texture_u texture_v,
// texture_s texture_t) if the file has them; faces vertex_indices or vertex_index, polygons cut into a fan.
// All else is skipped. Throws InputError naming file and cause; a count is believed only as far as the file
// is long.
PlyMesh read_ply(const std::filesystem::path& file);

}  // namespace lucerna
