// More light paths than sets hold, and of their VPLs those that the picture needs.
//
// Learned emission (photon/learned_emission.h) ends where a path leaves its light: what most of a path's VPLs
// do for the picture is decided later, behind the door or before it. So several times as many paths are
// traced, which costs little beside shading, and their VPLs are thinned: each is tried at places that the
// camera sees, shadow rays and all, and kept with a probability that goes by its importance there,
//
//   I = root of the mean over places of (X / L)²,    p = min(1, c (β · mean I + (1 - β) · I)),
//
// c such that as many are kept as one set's own paths would have made. What is kept is divided by p: every
// mean stays what it is, since p > 0 and the places do not know by whom they will be shaded; and no light
// weighs more than 1/β (the defensive weight) times what it would among as many kept blindly. Within a set
// the choice is systematic (one number for all), so that the sum of a set's importance hardly varies.
//
// Source: Georgiev and Slusallek, "Simple and robust iterative importance sampling of virtual point lights",
// 2010, who accept lights by their contribution to the image as a whole; here each is weighed relative to
// what the pixels show, as the paths are.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/integrators/igi_pre_pass.h"

namespace lucerna {

// Light paths that are traced for each of a set's own, and how many all sets may trace together: some 700 MB
// of lights at most, while they are tried.
inline constexpr std::uint32_t kThinning = 16, kMostPathsToThin = 1U << 22;

// As many as that leaves for sets of so many paths, a power of 2; 1: none are to spare.
inline std::uint32_t thinning(const VplParameters& parameters) {
    const std::uint64_t paths = std::uint64_t{parameters.sets} * parameters.paths;  // powers of 2, at least 1
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kMostPathsToThin / paths, 1, kThinning));
}

// Keeps about 1/factor of each set's lights, factor at least 1. The same for any number of threads.
VplSets thin_vpls(const VplSets& sets, std::uint32_t factor, const SeenPlaces& seen,
                  const IgiSettings& settings, const PassContext& context);

}  // namespace lucerna
