// How long paths get. Russian roulette ends them, be they light paths or paths from the eye; the limits on
// their number of bounces are against those that it does not end.
//
// How long the paths are whose light an image shows is a setting of every method (maxdepth): all of them
// count the bounces of a whole path, from the light to the eye, be they at mirrors, on rough surfaces or in
// media. Rays that only look for places give up sooner than those that carry light.
#pragma once

#include <algorithm>

#include "engine/base/vec.h"

namespace lucerna {

// No path goes on for sure, so that even a closed box of albedo 1 comes to an end.
inline constexpr float kMaxSurvival = 0.999F;

// Against endless loops only; roulette ends paths long before (0.999^100000 is 1e-44).
inline constexpr int kMaxBounces = 100'000;

// The bounces of a path from the light to the eye, at the most, by a method's `maxdepth` (0: no limit).
inline int most_bounces(int max_depth) {
    return max_depth > 0 ? std::min(max_depth, kMaxBounces) : kMaxBounces;
}

// Roulette of paths from the eye begins here: the first bounces carry most of the light and are worth their
// rays.
inline constexpr int kRouletteFrom = 6;
// In a row of mirrors and glass it begins here: there is nothing to shade on the way, and a lamp seen by way
// of them is bright.
inline constexpr int kRouletteFromSpecular = 16;

// The chance with which a path from the eye goes on. `eta_scale` is what glass has made of its throughput:
// radiance compression says nothing about how much a path carries.
inline float survival_of(const Rgb& throughput, float eta_scale) {
    return std::min(kMaxSurvival, max_component(throughput) / eta_scale);
}

// Surfaces that a short ray goes through on its way to the one that it looks for: sheets of glass, or sheets
// that lie close to each other.
inline constexpr int kMaxSheets = 8;

}  // namespace lucerna
