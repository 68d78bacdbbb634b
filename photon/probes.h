// What of an estimate is real, asked of the scene: how much of its disc photons could have reached, and how
// many of those found reached it [Jensen 2001, 7].
//
// A photon counts by where its path crosses the disc. Two things can be wrong with that. The path may cross
// where the surface has ended, and the next one would find nothing there: the share of the kernel where
// photons can be found (boundary.h). And something may stand between: the path ended on the far side of a
// thin wall, or of a rib, over the plane, or began behind one, under it, and never crossed the disc. One rule
// decides for both, so that what is divided by belongs to what is summed:
//
//   a photon that rests over the plane counts if x sees where it rests (it would have gone on into the disc);
//   one that rests under it, if x sees where it crossed the plane, and nothing lies from there to its rest.
//
// Rays begin a little over the surfaces they ask about: a share of the radius, and never less than what
// rounding leaves open. A disc hardly wider than that is taken for flat as far as float32 can tell.
//
// A few photons, picked in proportion to what each brings, speak for all: their part is right in the mean.
#pragma once

#include <span>

#include "engine/base/vec.h"
#include "engine/scene/scene.h"
#include "photon/kernel.h"
#include "photon/tangent_metric.h"

namespace lucerna {

struct ProbedDisc {
    V3f x, n;
    float r2;     // squared radius, scene units, > 0
    float ball2;  // TangentMetric::ball2 of it
    KernelShape kernel;
    float error;  // how far x may lie off its surface, scene units
};
// Where it rests, and its direction of travel, unit, n·d < 0.
struct ProbedPhoton {
    V3f p, d;
};
struct Probed {
    float share;  // of the kernel over places where photons like these would have counted, in (0,1]
    float part;   // of the photons that count, in [0,1]
};

// Chance, in [0,1): which of the photons are asked first, and how the probes' places are turned.
struct ProbeChance {
    float first;
    V2f place;
};

inline constexpr std::size_t kProbedPhotons = 8;
inline constexpr std::size_t kProbedDirections = 2;  // of photons that count
inline constexpr int kProbes = 16;                   // of each direction

// `photons`: at least one, at most kProbedPhotons, each standing for as much of what was found as any other.
// The mean of the directions' shares is the harmonic one: directions of a small share are found as seldom as
// it is small.
Probed probe(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
             std::span<const ProbedPhoton> photons, const ProbeChance& chance);

}  // namespace lucerna
