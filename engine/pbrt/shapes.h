// What the readers of single shapes share.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/pbrt/object_mesh.h"
#include "engine/pbrt/state.h"

namespace lucerna {

// Each in the file of its kind: mesh_shapes, nurbs_shape, quadric_shapes, patch_shapes, curve_shapes. None:
// the shape is left out, which has been said.
ObjectMesh read_triangle_mesh(Params& params);
std::optional<ObjectMesh> read_ply_mesh(Reading& reading, Params& params);
ObjectMesh read_array_mesh(const Reading& reading, Params& params);
ObjectMesh read_loop_mesh(Params& params);
ObjectMesh read_height_field(Params& params);
ObjectMesh read_nurbs(Params& params);
void add_quadric(Reading& reading, const std::string& kind, Params& params);
void add_patches(Reading& reading, Params& params);
void add_curve(Reading& reading, Params& params);

// Material, side, media and cut-outs that hold here. Nothing: the shape is wholly cut out.
std::optional<SurfaceTraits> traits_here(Reading& reading, Params& params);
// These traits for normals that are cross products of edges in world space.
SurfaceTraits of_world_edges(const Reading& reading, SurfaceTraits traits);
// Whether an area light holds here and can be on a surface; warns if one holds and cannot.
bool emits(Reading& reading, const Params& params);
// The area light that holds here becomes a light of that surface of the draft.
std::int32_t attach_light(Reading& reading, const SurfaceTraits& traits, AreaSpec::Surface surface,
                          std::size_t index);
// Moved to world space; with the light that holds here.
void add_mesh(Reading& reading, const Params& params, const SurfaceTraits& traits, ObjectMesh object);

// Shapes that emit but are none of those that can exactly: as triangles, for geometry and light alike.
ObjectMesh tessellated(const Quadric& quadric);  // 128 sectors in a full turn, 32 rings where it is curved

std::vector<V3d> triples(const Param& param);
void require_count(const Param& param, std::size_t have, std::size_t want);
// Texture coordinates, if any: one for each of so many vertices.
std::vector<V2f> read_uv(Params& params, std::size_t vertices);
// Indices of vertices, a multiple of `corners`; 0 1 2 ... where the shape has just as many vertices and none
// are given.
std::vector<int> read_indices(Params& params, std::size_t vertices, std::size_t corners);
V3d transformed_point(const Reading& reading, const Params& params, const V3d& p, std::size_t index);

}  // namespace lucerna
