// Describes surfaces of the scene, in world space relative to the scene's own origin.
#pragma once

#include <Imath/ImathVec.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/texture.h"

namespace lucerna {

inline constexpr std::int32_t kNoLight = -1;

inline constexpr std::int32_t kNoMedium = -1;

// Holds the media on both sides of a surface, as indices into SceneMedia::all. `outside` is on the side of
// Hit's geometric normal (ReverseOrientation swaps the two, as in pbrt). A path's medium changes only where
// `is_interface` is set.
struct MediumInterface {
    bool is_interface = false;
    std::int32_t inside = kNoMedium, outside = kNoMedium;
};

// Holds the attributes of a surface beside its shape.
struct SurfaceTraits {
    std::uint32_t material = 0;        // index into SceneParts::materials
    std::int32_t light = kNoLight;     // index into SceneParts::lights
    bool reverse_orientation = false;  // the geometric normal (the side that emits) is flipped
    MediumInterface media = {};        // media on both sides, if the surface is a medium interface
    // These are cut-outs: a ray passes where the value is 0, and with probability 1 - value in between; null
    // means solid. `alpha` holds for all rays, `shadow_alpha` in addition for shadow rays.
    std::shared_ptr<const FloatTexture> alpha = {}, shadow_alpha = {};
};

// Holds triangles. `n` and `uv` are empty or have one entry per vertex. The geometric normal of a triangle is
// (p1-p0) × (p2-p0), flipped by reverse_orientation. Given shading normals are turned towards the geometric
// normal, NOT the reverse.
struct Mesh {
    std::vector<V3f> p;
    std::vector<V3i> triangles;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// Describes a surface of revolution about z, or a disk, under an affine map: exact, not tessellated. Object
// space is as in pbrt: sphere, cylinder and paraboloid reach from z_min to z_max, the disk lies in z =
// height, the cone's tip is at z = height over a base in z = 0, and the line from p1 to p2 sweeps the
// hyperboloid. All may be partial in phi. Normals point outwards (along +z for a disk, inwards for a
// hyperboloid whose p2 lies below p1), flipped by reverse_orientation.
struct Quadric {
    enum class Kind : std::uint8_t { sphere, disk, cylinder, cone, paraboloid, hyperboloid };
    Kind kind = Kind::sphere;
    float radius = 1;                           // object units, > 0; unused by the hyperboloid
    float z_min = -INFINITY, z_max = INFINITY;  // sphere, cylinder, paraboloid
    float height = 0, inner_radius = 0;         // disk; cone (height > 0)
    V3f p1{0, 0, 0}, p2{1, 1, 1};               // hyperboloid; p1.z != p2.z
    float phi_max = 2 * kPi;                    // radians
    M44d world_from_object;  // Imath convention: row vectors, p_world = p_object * M; relative to the scene's
                             // origin
    SurfaceTraits traits;
};

// Holds bilinear patches p(u, v) with corners 00, 10, 01, 11 in this order. `n` and `uv` are empty or have
// one entry per vertex. The geometric normal is dp/du × dp/dv, flipped by reverse_orientation; where `n` is
// given, it is turned to the side of `n` instead.
struct BilinearMesh {
    std::vector<V3f> p;
    std::vector<std::array<std::int32_t, 4>> patches;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// Holds cubic Bézier curves with a width: hair, grass, wire.
struct Curves {
    using V4f = Imath::V4f;
    enum class Kind : std::uint8_t {
        flat,   // a band that faces each ray
        round,  // a tube
        ribbon  // a band that faces given normals
    };
    // Describes a segment of a curve, with the part of the whole curve's u that it covers.
    struct Segment {
        float u_from = 0, u_to = 1;
    };
    Kind kind = Kind::flat;
    std::vector<V4f> control;  // four for each segment: x y z and the radius there
    std::vector<V3f> n;        // ribbon: one per control point
    std::vector<Segment> segments;
    SurfaceTraits traits;
};

// Holds all shapes that lie in one frame of reference.
struct Shapes {
    std::vector<Mesh> meshes;
    std::vector<Quadric> quadrics;
    std::vector<BilinearMesh> patches;
    std::vector<Curves> curves;
};

// Places a copy of a prototype's shapes.
struct Instance {
    std::uint32_t prototype = 0;  // index into SceneParts::prototypes
    M44d world_from_prototype;    // affine, invertible; relative to the scene's origin
};

// Intersects a bilinear patch in double: p(u, v) = (1-u)(1-v) p00 + u(1-v) p10 + (1-u)v p01 + uv p11.
struct PatchShape {
    V3d p00, p10, p01, p11;

    PatchShape(const BilinearMesh& mesh, std::size_t patch);

    struct Crossing {
        double t, u, v;  // t in units of d's length
    };
    // Returns the nearest crossing with t_min < t <= t_max.
    std::optional<Crossing> nearest(const V3d& o, const V3d& d, double t_min, double t_max) const;

    V3d point(double u, double v) const;
    V3d dpdu(double v) const { return (1 - v) * (p10 - p00) + v * (p11 - p01); }
    V3d dpdv(double u) const { return (1 - u) * (p01 - p00) + u * (p11 - p10); }
    // Returns the unit normal; where an edge has shrunk to a point, that of the patch as a whole.
    V3d normal(double u, double v) const;
    // Returns the largest side of the bounds.
    float extent() const;
    bool is_flat_parallelogram() const;
};

// Holds points and normals of a coarse triangle mesh's limit surface under Loop subdivision.
struct LoopMesh {
    std::vector<V3d> p, n;  // n unit, on the side of the triangles' own normals
    std::vector<V3i> triangles;
};

// Each level splits every triangle into four. Boundaries are creases, as in pbrt. Throws InputError for what
// is not a surface: a triangle that names a vertex twice, or an edge of more than two triangles, or of two
// with opposite orientation.
LoopMesh subdivide_loop(const std::vector<V3d>& p, const std::vector<V3i>& triangles, int levels);

// Holds a mesh from a PLY file (Stanford polygon format), as pbrt's plymesh reads it. `n` and `uv` are empty
// or have one entry per vertex; every index is valid.
struct PlyMesh {
    std::vector<V3f> p;  // the file's units
    std::vector<V3f> n;
    std::vector<V2f> uv;
    std::vector<V3i> triangles;
};

// Reads ASCII or binary of either byte order. Vertices have x y z, and optionally nx ny nz and u v (or s t,
// texture_u texture_v, texture_s texture_t); faces have vertex_indices or vertex_index, and polygons become
// triangle fans. Everything else is skipped. Throws InputError that names file and cause; a count is trusted
// only up to the file's length.
PlyMesh read_ply(const std::filesystem::path& file);

}  // namespace lucerna
