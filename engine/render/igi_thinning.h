// More light paths than sets hold, and of their virtual lights those that the picture needs.
//
// A plan of starts (photon/emission_plan.h) ends where a path leaves its light: what most of a path's virtual
// lights do for the picture is decided later, behind the door or before it. So several times as many paths
// are walked, which costs little beside shading, and their virtual lights are thinned: each is tried at
// places that the camera sees, shadow rays and all, and kept with a probability that goes by what it was
// worth there,
//
//   I = root of the mean over places of (X / L)²,    p = min(1, c (floor · mean I + (1 - floor) · I)),
//
// c such that as many are kept as one set's own paths would have made. What is kept is divided by p: every
// mean stays what it is, since p > 0 and the places do not know by whom they will be shaded; and no light
// weighs more than 1/floor times what it would among as many kept blindly. Within a set the choice is
// systematic (one number for all), so that the sum of what a set is worth hardly varies.
//
// Source: Georgiev and Slusallek, "Simple and robust iterative importance sampling of virtual point lights",
// 2010, who accept lights by their contribution to the image as a whole; here each is weighed relative to
// what the pixels show, as the paths are.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/render/igi_pilot.h"

namespace lucerna {

// Light paths that are walked for each of a set's own, and how many all sets may walk together: some 700 MB
// of lights at most, while they are tried.
inline constexpr std::uint32_t kThinning = 16, kMostPathsToThin = 1U << 22;

// As many as that leaves for sets of so many paths, a power of 2; 1: none are to spare.
inline std::uint32_t thinning(const VirtualLightPlan& plan) {
    const std::uint64_t paths = std::uint64_t{plan.sets} * plan.paths;  // powers of 2, at least 1
    return static_cast<std::uint32_t>(std::clamp<std::uint64_t>(kMostPathsToThin / paths, 1, kThinning));
}

// Keeps about 1/factor of each set's lights, factor at least 1. The same for any number of threads.
VirtualLightSets thin_virtual_lights(const VirtualLightSets& sets, std::uint32_t factor,
                                     const SeenPlaces& seen, const IgiSettings& settings,
                                     const PassContext& context);

}  // namespace lucerna
