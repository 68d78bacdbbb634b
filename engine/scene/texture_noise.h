// Perlin's gradient noise and the sums of it that textures are made of.
//
// Source: Perlin, "Improving Noise", SIGGRAPH 2002: gradients towards the edges of a cube, chosen by a hash
// of the lattice point, joined by a quintic. The hash is his published permutation, and which gradient a hash
// value stands for is as in pbrt, so that a pbrt scene keeps its pattern. In double, for places far from the
// origin.
#pragma once

#include <span>

#include "engine/base/vec.h"

namespace lucerna {

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

}  // namespace lucerna
