// Makes textures given by a formula. They take textures as arguments where pbrt does, and fold constants.
#pragma once

#include <array>
#include <span>

#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "engine/scene/texture.h"

namespace lucerna {

// Implements Perlin's gradient noise and its sums over octaves.
//
// [Perlin 2002]: gradients point towards the edges of a cube, are chosen by a hash of the lattice point, and
// are blended by a quintic. The hash is his published permutation, and the assignment of gradients to hash
// values is pbrt's, so that a pbrt scene keeps its pattern. Doubles serve places far from the origin.

// Returns noise in ±kNoiseBound: 0 at lattice points, twice continuously differentiable, period 256.
double perlin_noise(const V3d& p);
inline constexpr double kNoiseBound = 1.04;  // the largest value is about 1.036

// Describes octaves of noise: each has 1.99 times the frequency (not 2, so that lattice points do not
// coincide) and `omega` times the amplitude of the one before.
struct Octaves {
    double omega = 0.5;
    int count = 8;
};
double fractal_noise(const V3d& p, const Octaves& octaves);  // pbrt's fBm
double turbulence(const V3d& p, const Octaves& octaves);     // sum of absolute values
// These evaluate several places with the same bits, but faster, because they compute octaves of all places
// together. `noise` must be as long as `at`.
void fractal_noise(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise);
void turbulence(std::span<const V3d> at, const Octaves& octaves, std::span<double> noise);
// Returns a bound of the absolute values of both.
double fractal_bound(const Octaves& octaves);

// Returns a · b, or a · by.
template <typename Value>
Texture<Value> product_texture(const Texture<Value>& a, const Texture<Value>& b);
template <typename Value>
Texture<Value> scaled_texture(const Texture<Value>& a, const FloatTexture& by);
// Returns (1 - amount) a + amount b.
template <typename Value>
Texture<Value> mix_texture(const Texture<Value>& a, const Texture<Value>& b, const FloatTexture& amount);
// Returns |n · direction| a + (1 - |n · direction|) b; (a + b)/2 without a normal. `direction` is unit.
template <typename Value>
Texture<Value> direction_mix_texture(const Texture<Value>& a, const Texture<Value>& b, const V3d& direction);

// Returns unit squares of the plane, or unit cubes of space; the one that starts at the origin is even.
template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping2& mapping);
template <typename Value>
Texture<Value> checkerboard_texture(const Texture<Value>& even, const Texture<Value>& odd,
                                    const Mapping3& mapping);
// Interpolates the values at (0,0), (0,1), (1,0) and (1,1) of (s,t), in this order. Beyond the unit square it
// uses the values of the square's edge (pbrt extrapolates, which may make a reflectance exceed 1).
template <typename Value>
Texture<Value> bilerp_texture(const std::array<Value, 4>& corners, const Mapping2& mapping);
// Returns discs of radius 0.35 in some of the unit squares around integer (s,t), displaced by noise.
template <typename Value>
Texture<Value> dots_texture(const Texture<Value>& inside, const Texture<Value>& outside,
                            const Mapping2& mapping);

// Returns the fractional parts of s and t as red and green.
RgbTexture uv_texture(const Mapping2& mapping);

FloatTexture fbm_texture(const Octaves& octaves, const Mapping3& mapping);       // may be negative
FloatTexture wrinkled_texture(const Octaves& octaves, const Mapping3& mapping);  // turbulence
FloatTexture windy_texture(const Mapping3& mapping);  // waves on water; may be negative
// Describes layers across y, `scale` of them per unit, distorted by `variation` times noise.
struct Marble {
    Octaves octaves;
    double scale = 1, variation = 0.2;
};
RgbTexture marble_texture(const Marble& marble, const Mapping3& mapping);

// These convert a number to grey (0 where it is negative), and a colour to its luminance.
RgbTexture grey_texture(const FloatTexture& of);
FloatTexture luminance_texture(const RgbTexture& of);
// Converts linear sRGB to ratios of a working space.
RgbTexture ratio_texture(const RgbTexture& of, const WorkingSpace& colours);
// Clamps to [least, most], channel by channel.
template <typename Value>
Texture<Value> clamped_texture(const Texture<Value>& of, float least, float most);

}  // namespace lucerna
