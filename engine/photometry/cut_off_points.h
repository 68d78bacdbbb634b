// Points of a calculation surface that lie inside furniture, walls or closed rooms, where no light comes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/scene/receiver.h"

namespace lucerna {

// Returns which receivers are cut off from the light, given the illuminance at each and the part of it that
// comes straight from lamps. Such a receiver has next to no light, relative to the mean receiver, and random
// walks from it, from surface to surface, neither leave the scene nor come into sight of a receiver that has
// light. So a point in the shadow of a wall is not cut off, however dark it is.
std::vector<bool> cut_off_points(const Scene& scene, std::span<const Receiver> receivers,
                                 std::span<const double> all, std::span<const double> direct,
                                 std::uint64_t seed, const Workers& workers);

}  // namespace lucerna
