// Textures with a formula. All take textures as ingredients where pbrt does, and fold constants.
#pragma once

#include <array>
#include <span>

#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "engine/scene/texture.h"

namespace lucerna {

// Perlin's gradient noise and the sums of it that textures are made of.
//
// [Perlin 2002]: gradients towards the edges of a cube, chosen by a hash
// of the lattice point, joined by a quintic. The hash is his published permutation, and which gradient a hash
// value stands for is as in pbrt, so that a pbrt scene keeps its pattern. In double, for places far from the
// origin.

// In [-kNoiseBound, kNoiseBound], 0 at lattice points, twice continuously differentiable, period 256.
double perlin_noise(const V3d& p);
inline constexpr double kNoiseBound = 1.04;  // the largest value is about 1.036

// Octaves of noise: each has 1.99 times the frequency (not 2, so that lattice points do not coincide) and
// `omega` times the amplitude of the one before.
struct Octaves {
    double omega = 0.5;
    int count = 8;
};
double fractal_noise(const V3d& p, const Octaves& octaves);  // pbrt's fBm
double turbulence(const V3d& p, const Octaves& octaves);     // of absolute values
// The same at several places, bit for bit and quicker: octaves of all of them are looked up together. As many
// answers as places.
void fractal_noise(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise);
void turbulence(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise);
// What neither exceeds.
double fractal_bound(const Octaves& octaves);

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
// Of linear sRGB, as ratios of a working space.
RgbTexture ratio_texture(const RgbTexture& of, const WorkingSpace& colours);
// Held to [least, most], channel by channel.
template <typename Value>
Texture<Value> clamped_texture(const Texture<Value>& of, float least, float most);

}  // namespace lucerna
