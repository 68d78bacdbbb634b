// Textures with a formula. All take textures as ingredients where pbrt does, and fold constants.
#pragma once

#include <array>

#include "engine/scene/texture.h"
#include "engine/scene/texture_mapping.h"
#include "engine/scene/texture_noise.h"

namespace lucerna {

// a · b.
template <typename Value>
Texture<Value> product_texture(const Texture<Value>& a, const Texture<Value>& b);
template <typename Value>
Texture<Value> scaled_texture(const Texture<Value>& a, const FloatTexture& by);
// (1 - amount) a + amount b.
template <typename Value>
Texture<Value> mix_texture(const Texture<Value>& a, const Texture<Value>& b, const FloatTexture& amount);
// |n · direction| a + (1 - |n · direction|) b; half and half where the normal is not known. `direction` unit.
template <typename Value>
Texture<Value> direction_mix_texture(const Texture<Value>& a, const Texture<Value>& b, const V3d& direction);

// Unit squares of the plane, unit cubes of space; the one that starts at the origin is even.
template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping2& mapping);
template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping3& mapping);
// Between the values at (0,0), (0,1), (1,0) and (1,1) of (s,t), in this order; beyond the unit square the
// values of its edge (pbrt extrapolates, which turns a reflectance into something above 1).
template <typename Value>
Texture<Value> bilerp_texture(const std::array<Value, 4>& corners, const Mapping2& mapping);
// Discs of radius 0.35 in some of the unit squares around whole (s,t), pushed about by noise.
template <typename Value>
Texture<Value> dots_texture(const Texture<Value>& inside, const Texture<Value>& outside,
                            const Mapping2& mapping);

// The fractions of s and t as red and green.
RgbTexture uv_texture(const Mapping2& mapping);

FloatTexture fbm_texture(const Octaves& octaves, const Mapping3& mapping);       // may be negative
FloatTexture wrinkled_texture(const Octaves& octaves, const Mapping3& mapping);  // turbulence
FloatTexture windy_texture(const Mapping3& mapping);  // waves on water; may be negative
// Layers across y, `scale` of them per unit, distorted by `variation` times noise.
struct Marble {
    Octaves octaves;
    double scale = 1, variation = 0.2;
};
RgbTexture marble_texture(const Marble& marble, const Mapping3& mapping);

// Grey of a number, 0 where it is negative, and the luminance of a colour.
RgbTexture grey_texture(const FloatTexture& of);
FloatTexture luminance_texture(const RgbTexture& of);
// Held to [least, most], channel by channel.
template <typename Value>
Texture<Value> clamped_texture(const Texture<Value>& of, float least, float most);

}  // namespace lucerna
