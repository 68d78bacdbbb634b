// Surfaces as the scene holds them: in world space, relative to the scene's own origin.
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

// The media on the two sides of a surface, as indices into SceneMedia::all; `outside` lies on the side of the
// geometric normal as Hit has it (ReverseOrientation swaps the two, as in pbrt). Only a surface that is a
// border changes what a path is in.
struct MediumInterface {
    bool border = false;
    std::int32_t inside = kNoMedium, outside = kNoMedium;
};

// What every surface has beside its shape.
struct SurfaceTraits {
    std::uint32_t material = 0;        // index into SceneParts::materials
    std::int32_t light = kNoLight;     // index into SceneParts::lights
    bool reverse_orientation = false;  // the geometric normal (the side that emits) is flipped
    MediumInterface media = {};        // what lies on either side, if the surface is a border
    // Cut-outs: where the number is 0 there is nothing, in between a part of the rays passes; null: solid.
    // The first holds for all rays, the second for those that only ask what they can see.
    std::shared_ptr<const FloatTexture> alpha = {}, shadow_alpha = {};
};

// Triangles. `n` and `uv` are empty or have one entry per vertex. The geometric normal of a triangle is
// (p1-p0) × (p2-p0), flipped by reverse_orientation; when shading normals are given it is NOT turned towards
// them (the shading normal is turned towards the geometric one).
struct Mesh {
    std::vector<V3f> p;
    std::vector<V3i> triangles;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// A surface of revolution about z, or a disk, under an affine map: exact, not tessellated. Object space, as
// pbrt defines it: sphere, cylinder and paraboloid reach from z_min to z_max, the disk lies in z = height,
// the cone's tip in z = height over a base in z = 0; the hyperboloid is swept by the line from p1 to p2. All
// may be partial in phi. Normals point outwards (along +z for a disk; for a hyperboloid whose p2 lies below
// p1 inwards), flipped by reverse_orientation.
struct Quadric {
    enum class Kind : std::uint8_t { sphere, disk, cylinder, cone, paraboloid, hyperboloid };
    Kind kind = Kind::sphere;
    float radius = 1;                           // object units, > 0; not of the hyperboloid
    float z_min = -INFINITY, z_max = INFINITY;  // sphere, cylinder, paraboloid
    float height = 0, inner_radius = 0;         // disk; cone (height > 0)
    V3f p1{0, 0, 0}, p2{1, 1, 1};               // hyperboloid; p1.z != p2.z
    float phi_max = 2 * kPi;                    // radians
    M44d world_from_object;  // Imath convention: row vectors, p_world = p_object * M; relative to the scene's
                             // origin
    SurfaceTraits traits;
};

// Bilinear patches: p(u, v) between corners 00, 10, 01, 11 in this order. `n` and `uv` are empty or have one
// entry per vertex. The geometric normal is dp/du × dp/dv, flipped by reverse_orientation; where `n` is given
// it is turned to the side of that instead.
struct BilinearMesh {
    std::vector<V3f> p;
    std::vector<std::array<std::int32_t, 4>> patches;
    std::vector<V3f> n;
    std::vector<V2f> uv;
    SurfaceTraits traits;
};

// Cubic Bézier curves with a width: hair, grass, wire.
struct Curves {
    using V4f = Imath::V4f;
    enum class Kind : std::uint8_t {
        flat,   // a band that turns to each ray
        round,  // a tube
        ribbon  // a band that turns to given normals
    };
    // A piece of a curve, with the part of the whole curve's u that it covers.
    struct Segment {
        float u_from = 0, u_to = 1;
    };
    Kind kind = Kind::flat;
    std::vector<V4f> control;  // four for each segment: x y z and the radius there
    std::vector<V3f> n;        // ribbon: one per control point
    std::vector<Segment> segments;
    SurfaceTraits traits;
};

// All that lies in one frame of reference.
struct Shapes {
    std::vector<Mesh> meshes;
    std::vector<Quadric> quadrics;
    std::vector<BilinearMesh> patches;
    std::vector<Curves> curves;
};

// A prototype's shapes once more, elsewhere.
struct Instance {
    std::uint32_t prototype = 0;  // index into SceneParts::prototypes
    M44d world_from_prototype;    // affine, invertible; relative to the scene's origin
};

// Bilinear patches, met exactly, in double precision.

// p(u, v) = (1-u)(1-v) p00 + u(1-v) p10 + (1-u)v p01 + uv p11
struct PatchShape {
    V3d p00, p10, p01, p11;

    PatchShape(const BilinearMesh& mesh, std::size_t patch);

    struct Crossing {
        double t, u, v;  // t in units of d's length
    };
    // The nearest with t_min < t <= t_max.
    std::optional<Crossing> nearest(const V3d& o, const V3d& d, double t_min, double t_max) const;

    V3d point(double u, double v) const;
    V3d dpdu(double v) const { return (1 - v) * (p10 - p00) + v * (p11 - p01); }
    V3d dpdv(double u) const { return (1 - u) * (p01 - p00) + u * (p11 - p10); }
    // Unit; where an edge has shrunk to a point, that of the patch as a whole.
    V3d normal(double u, double v) const;
    // Largest side of the bounds.
    float extent() const;
    bool is_flat_parallelogram() const;
};

// Loop subdivision: a coarse mesh of triangles to points and normals of its limit surface.
struct LoopMesh {
    std::vector<V3d> p, n;  // n unit, on the side of the triangles' own normals
    std::vector<V3i> triangles;
};

// Each level cuts every triangle into four. Boundaries are creases (pbrt's rule, too). Throws InputError for
// what is no surface: a triangle that names a vertex twice, an edge of more than two triangles.
LoopMesh subdivide_loop(const std::vector<V3d>& p, const std::vector<V3i>& triangles, int levels);

// PLY files (Stanford polygon format), as pbrt's plymesh reads them.

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
