// Functions that the readers of single shapes share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/pbrt/object_mesh.h"
#include "engine/pbrt/state.h"

namespace lucerna {

// Each function is in the file of its kind: mesh_shapes, nurbs_shape, quadric_shapes, patch_shapes,
// curve_shapes. An empty result means that the shape is left out, which is reported.
ObjectMesh read_triangle_mesh(Params& params);
std::optional<ObjectMesh> read_ply_mesh(Reading& reading, Params& params);
ObjectMesh read_array_mesh(const Reading& reading, Params& params);
ObjectMesh read_loop_mesh(Params& params);
ObjectMesh read_height_field(Params& params);
ObjectMesh read_nurbs(Params& params);
void add_quadric(Reading& reading, const std::string& kind, Params& params);
void add_patches(Reading& reading, Params& params);
void add_curve(Reading& reading, Params& params);

// Returns the current material, side, media and cut-outs, or nothing if the shape is completely cut out.
std::optional<SurfaceTraits> traits_here(Reading& reading, Params& params);
// Adapts traits to normals that are cross products of edges in world space.
SurfaceTraits of_world_edges(const Reading& reading, SurfaceTraits traits);
// Tells whether an area light applies to the shape; warns if one is set that cannot.
bool emits(Reading& reading, const Params& params);
// Makes the current area light a light of that surface of the draft.
std::int32_t attach_light(Reading& reading, const SurfaceTraits& traits, AreaSpec::Surface surface,
                          std::size_t index);
// Moves a mesh to world space and adds it with the current light.
void add_mesh(Reading& reading, const Params& params, const SurfaceTraits& traits, ObjectMesh object);

// Converts shapes that emit, but not in closed form, to triangles for geometry and light alike.
ObjectMesh tessellated(const Quadric& quadric);  // 128 sectors in a full turn, 32 rings where it is curved

std::vector<V3d> triples(const Param& param);
void require_count(const Param& param, std::size_t have, std::size_t want);
// Reads texture coordinates, if any, one for each of `vertices`.
std::vector<V2f> read_uv(Params& params, std::size_t vertices);
// Reads vertex indices, a multiple of `corners`. The default is 0 1 2 ... if the shape has exactly `corners`
// vertices.
std::vector<int> read_indices(Params& params, std::size_t vertices, std::size_t corners);
V3d transformed_point(const Reading& reading, const Params& params, const V3d& p, std::size_t index);

}  // namespace lucerna
