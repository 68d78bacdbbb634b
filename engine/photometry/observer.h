// An observer's eye, and how much less glaring light is away from its line of sight.
#pragma once

#include <string>

#include "engine/base/vec.h"

namespace lucerna {

struct Observer {
    std::string name;
    V3d eye;   // world, scene units (metres)
    V3f view;  // unit: the line of sight
    V3f up;    // unit, not along `view`
    // Of the scene's axes: pbrt's are left-handed, unless a scene mirrors them. Tells right from left.
    bool right_handed = false;

    V3f right() const {  // unit
        return (right_handed ? view.cross(up) : up.cross(view)).normalized();
    }
};

// Guth's position index of a direction, >= 1: above the line of sight by the fit of [Levin 1975], below it by
// that of [Iwata and Tokura 1997]. `from_vertical`: the angle between the upright plane through the line of
// sight and the plane of both directions; `from_view`: between the two; both degrees.
double position_index(double from_vertical, double from_view);
// The same of a direction `w` in front of the observer (unit). Behind: infinite, nothing of it is seen.
double position_index(const Observer& observer, const V3f& w);

}  // namespace lucerna
