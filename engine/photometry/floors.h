// Finds the floors of a model, storey by storey.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace lucerna {

struct Floor {
    double height = 0;  // along the upward axis; world, scene units
    V3d least, most;    // bounds, world; both are at `height` along the upward axis
    double area = 0;    // square scene units
};

// Returns the floors from the lowest to the highest, for a model in metres with upward axis `up_axis` (0 to
// 2). A grid of vertical lines through the model finds the surfaces that are level within 3 degrees and have
// two metres of headroom. Those at one height (within 5 cm) form a floor if they cover a twentieth of the
// model's plan, unless a floor lies less than two metres below them, as it does below the tops of furniture.
// Surfaces under the open sky over a floor are its roof and are left out.
std::vector<Floor> floors_of(const Scene& scene, int up_axis);

}  // namespace lucerna
