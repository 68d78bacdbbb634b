// Surfaces as the scene holds them: in world space, relative to the scene's own origin.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/vec.h"

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

// A sphere or disk under an affine map: exact, not tessellated. Object space: the sphere is centred at 0, the
// disk lies in z = height; both may be partial, as pbrt defines it. Normals point outwards / along +z of
// object space, flipped by reverse_orientation.
struct Quadric {
    enum class Kind : std::uint8_t { sphere, disk } kind = Kind::sphere;
    float radius = 1;                           // object units, > 0
    float z_min = -INFINITY, z_max = INFINITY;  // sphere
    float height = 0, inner_radius = 0;         // disk
    float phi_max = 2 * kPi;                    // radians
    M44d world_from_object;  // Imath convention: row vectors, p_world = p_object * M; relative to the scene's
                             // origin
    SurfaceTraits traits;
};

}  // namespace lucerna
