// Limits the length of paths. Russian roulette ends paths from lights and from the eye; the limits on their
// numbers of bounces catch those that it does not end.
//
// A setting of every method (maxdepth) limits the paths whose light an image shows. All methods count the
// bounces of the whole path, from light to eye, at mirrors, rough surfaces and in media. Rays that only
// search for places end sooner than those that carry light.
#pragma once

#include <algorithm>

#include "engine/base/vec.h"

namespace lucerna {

// No path survives with certainty, so that even a closed box of albedo 1 comes to an end.
inline constexpr float kMaxSurvival = 0.999F;

// This only prevents endless loops; Russian roulette ends paths long before (0.999^100000 is 1e-44).
inline constexpr int kMaxBounces = 100'000;

// Returns the largest number of bounces from light to eye for a method's `maxdepth` (0: no limit).
inline int most_bounces(int max_depth) {
    return max_depth > 0 ? std::min(max_depth, kMaxBounces) : kMaxBounces;
}

// Russian roulette of paths from the eye begins after this many bounces, because the first bounces carry most
// of the light and are worth their rays.
inline constexpr int kRouletteFrom = 6;
// In a chain of mirrors and glass it begins later, because there is nothing to shade on the way, and a lamp
// seen through the chain is bright.
inline constexpr int kRouletteFromSpecular = 16;

// Returns the survival probability of a path from the eye. `eta_scale` is the factor of its throughput due to
// radiance compression in glass, which says nothing about how much light the path carries.
inline float survival_of(const Rgb& throughput, float eta_scale) {
    return std::min(kMaxSurvival, max_component(throughput) / eta_scale);
}

// A short ray passes at most this many surfaces on its way to the surface that it searches for: sheets of
// glass, or sheets close to each other.
inline constexpr int kMaxSheets = 8;

}  // namespace lucerna
