// Corrects the boundary bias of density estimates [Jensen 2001, 7.2] with short rays: estimates which share
// of a disc photons could have reached, and which part of the photons found did reach it.
//
// A photon counts by the point at which its path crosses the disc, which can be wrong in two ways. At the
// edge of a surface the disc extends beyond it, where no photon can lie. The estimate is then too dark by the
// part of the kernel beyond the edge (half of it on a straight edge, three quarters at a right-angled
// corner); division by the remaining share corrects this, as far as the light is even over the disc.
// Secondly, an occluder may separate a photon from the disc: its path ended on the far side of a thin wall or
// rib that rises above the plane, or began behind one below the plane, and never crossed the disc. To find
// both, the paths of a few photons are moved across the disc, distributed as the kernel, and traced to see
// whether each ends where the metric would count it. One rule decides for probes and for photons found, so
// that the divisor fits the sum:
//
//   a photon above the plane counts if x sees the photon, which would otherwise have gone on into the disc;
//   a photon below it counts if x sees where it crossed the plane, and nothing stands from there to the
//   photon.
//
// Rays begin slightly above the surfaces that they test: by a share of the radius, and by at least the
// rounding error. A disc hardly wider than that counts as flat, as far as float32 can tell.
//
// A few photons, picked in proportion to their contributions, represent all; their estimate of the part is
// unbiased.
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
// Position and direction of travel (unit, n·d < 0) of a photon.
struct ProbedPhoton {
    V3f p, d;
};
struct Probed {
    float share;  // of the kernel, over points at which such photons would have counted, in (0,1]
    float part;   // fraction of the photons that count, in [0,1]
};

// Random numbers, in [0,1): `first` selects the photons that are tested, `place` shifts the points of the
// probes.
struct ProbeNumbers {
    float first;
    V2f place;
};

// Number of rays of an estimate. Fewer rays are as good in the mean, for estimates that are averaged.
inline constexpr std::size_t kProbedPhotons = 8;
struct ProbeEffort {
    std::size_t photons = kProbedPhotons;  // 1 to kProbedPhotons
    std::size_t directions = 2;            // of photons that count, along which probes are traced
    int places = 16;                       // probes for each direction
};

// Probes the disc of an estimate. `photons` are 1 to kProbedPhotons photons that each represent an equal part
// of the value found. Directions are found with a probability proportional to their share, so shares are
// averaged harmonically, which makes the mean of 1/share correct.
Probed probe(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
             std::span<const ProbedPhoton> photons, const ProbeNumbers& u, const ProbeEffort& effort = {});

// Returns whether no point at the rim of the disc is cut off and all photons count, so that probe() would
// have nothing to correct, as far as a few rays can tell.
bool is_whole(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
              std::span<const ProbedPhoton> photons, const ProbeNumbers& u);

}  // namespace lucerna
