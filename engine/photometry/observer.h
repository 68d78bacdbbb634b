// An observer's eye and the position index, by which light away from the line of sight glares less.
#pragma once

#include <string>

#include "engine/base/vec.h"

namespace lucerna {

struct Observer {
    std::string name;
    V3d eye;   // world, scene units (metres)
    V3f view;  // unit: the line of sight
    V3f up;    // unit, not along `view`
    // Handedness of the scene's axes; pbrt's are left-handed unless a scene mirrors them.
    bool right_handed = false;

    V3f right() const {  // unit
        return (right_handed ? view.cross(up) : up.cross(view)).normalized();
    }
};

// Returns Guth's position index of a direction, >= 1, by [Levin 1975] above the line of sight and [Iwata and
// Tokura 1997] below it. `from_vertical` is the angle between the vertical plane through the line of sight
// and the plane of both directions, `from_view` that between both; degrees.
double position_index(double from_vertical, double from_view);
// Returns the position index of a unit vector `w`, or infinity if it points behind the observer.
double position_index(const Observer& observer, const V3f& w);

}  // namespace lucerna
