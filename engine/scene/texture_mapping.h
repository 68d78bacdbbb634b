// From a point of a surface to the coordinates in which a texture is drawn: pbrt's mappings.
//
// World positions are double, because a pattern in space must not shimmer far from the origin. Nothing here
// fails: coordinates that are not finite come out as 0.
#pragma once

#include <cmath>
#include <variant>

#include "engine/base/vec.h"
#include "engine/scene/texture.h"

namespace lucerna {

using V2d = Imath::V2d;

// The surface's own coordinates: (scale.x u + delta.x, scale.y v + delta.y).
struct UvMapping {
    V2f scale{1, 1};
    V2f delta{0, 0};
};
// (θ/π, φ/2π) of the direction from the texture's origin, θ from its +z and φ from its +x towards +y.
struct SphericalMapping {
    M44d texture_from_world;
};
// ((π + atan2(y, x))/2π, z).
struct CylindricalMapping {
    M44d texture_from_world;
};
// (delta.x + p·v1, delta.y + p·v2).
struct PlanarMapping {
    M44d texture_from_world;
    V3d v1{1, 0, 0}, v2{0, 1, 0};
    V2d delta{0, 0};
};
using Mapping2 = std::variant<UvMapping, SphericalMapping, CylindricalMapping, PlanarMapping>;

// Coordinates in space, for textures that fill it.
struct Mapping3 {
    M44d texture_from_world;
};

V2d texture_st(const Mapping2& mapping, const TexturePoint& point);
V3d texture_position(const Mapping3& mapping, const TexturePoint& point);

}  // namespace lucerna
