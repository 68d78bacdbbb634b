// The lines in which a level plane cuts a scene, for plans.
#pragma once

#include <vector>

#include "engine/scene/scene.h"

namespace lucerna {

struct SectionLine {
    V3d from, to;  // world
};

// Returns the section of all surfaces within the box at `height` along the upward axis (0 to 2), each flat
// part as one line. It is found by rays in the plane, along both of its axes and `spacing` apart, so that all
// shapes and instances take part; a line's ends are exact to half of the spacing, its place to float
// precision.
std::vector<SectionLine> section(const Scene& scene, const Imath::Box<V3d>& box, int up_axis, double height,
                                 double spacing);

}  // namespace lucerna
