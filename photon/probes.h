// How much of an estimate's disc photons could have reached, and how many of those found reached it: the
// boundary bias of density estimates [Jensen 2001, 7.2], mended by short rays.
//
// A photon counts by where its path crosses the disc. Two things can be wrong with that. At the edge of a
// surface the disc hangs over: no photon lies there, and the estimate is too dark by the part of the kernel
// that hangs over (half of it on a straight edge, three quarters at a right corner). Divided by the share
// that does not, it is right again as far as the light is even over the disc. And something may stand
// between: the path ended on the far side of a thin wall, or of a rib, over the plane, or began behind one,
// under it, and never crossed the disc. A few photons' paths, moved across the disc as the kernel has it, are
// traced: does each end where the metric would have counted it? One rule decides for both, so that what is
// divided by belongs to what is summed:
//
//   a photon that lies over the plane counts if x sees where it lies (it would have gone on into the disc);
//   one that lies under it, if x sees where it crossed the plane, and nothing stands from there to where it
//   lies.
//
// Rays begin a little over the surfaces they ask about: a share of the radius, and never less than what
// rounding leaves open. A disc hardly wider than that is taken for flat as far as float32 can tell.
//
// A few photons, picked in proportion to what each brings, speak for all: their part is right in the mean.
#pragma once

#include <span>

#include "engine/base/vec.h"
#include "engine/scene/scene.h"
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

// Random numbers, in [0,1): which of the photons are asked first, and how the probes' places are turned.
struct ProbeNumbers {
    float first;
    V2f place;
};

// How many rays an estimate asks. Fewer are right in the mean all the same: for estimates of which many are
// averaged.
inline constexpr std::size_t kProbedPhotons = 8;
struct ProbeEffort {
    std::size_t photons = kProbedPhotons;  // 1 to kProbedPhotons
    std::size_t directions = 2;            // of photons that count
    int places = 16;                       // of each direction
};

// `photons`: at least one, at most kProbedPhotons, each standing for as much of what was found as any other.
// Photons' directions are found with a probability in proportion to their share: so shares are averaged
// harmonically, which makes the mean of 1/share right.
Probed probe(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
             std::span<const ProbedPhoton> photons, const ProbeNumbers& u, const ProbeEffort& effort = {});

// Whether no place at the disc's rim is cut off, and all of the photons count: then probe() would find
// nothing to correct, as far as few rays tell.
bool is_whole(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
              std::span<const ProbedPhoton> photons, const ProbeNumbers& u);

}  // namespace lucerna
