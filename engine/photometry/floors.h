// The floors of a model: where people stand in it, storey by storey.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace lucerna {

struct Floor {
    double height = 0;  // along the upward axis; world, scene units
    V3d least, most;    // bounds of it, world: `height` in both along the upward axis
    double area = 0;    // square scene units
};

// Found by vertical lines through the whole model, on a grid: of each, the surfaces that are level within 3
// degrees and have two metres of clear height above. What is found at one height (to 5 cm), over at least a
// twentieth of the model's plan, is a floor, from the lowest upwards, unless one lies less than two metres
// below it, as below the tops of furniture; what is under the sky above another floor is its roof. `up_axis`:
// 0 to 2. Scene units are metres. From the lowest to the highest.
std::vector<Floor> floors_of(const Scene& scene, int up_axis);

}  // namespace lucerna
