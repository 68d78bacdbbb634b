// Where a ray passes the two planes of a rig: the filters over it, and the pixel in which each of them sees
// it.
#pragma once

#include <array>
#include <cmath>

#include "lights/bell.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

// Where a ray passes the plane z = height, in its own frame. d.z > 0.
inline V2d pass_plane(const LampRay& ray, double height) {
    const double t = (height - double{ray.o.z}) / double{ray.d.z};
    return {double{ray.o.x} + t * double{ray.d.x}, double{ray.o.y} + t * double{ray.d.y}};
}

struct Passage {
    int base[2];                    // the filter at or below it, per axis
    std::array<double, 4> dual[2];  // Φ̃ of filters base - 1 ... base + 2 there
    int pixel[2][4];                // the pixel each of those sees it in; -1: none
    bool misses_s;                  // none of the filters exists; the rest is then undefined

    // d.z > 0; a rig without fault.
    Passage(const LampRay& ray, const Rig& rig) : base{}, pixel{}, misses_s(false) {
        const V2d centre(rig.centre.x, rig.centre.y);
        const V2d on_s = pass_plane(ray, rig.centre.z) - centre;
        const V2d on_m = pass_plane(ray, rig.centre.z + rig.distance) - centre;
        for (int a = 0; a < 2; ++a) {
            const double x = (on_s[a] - rig.filter(a, 0)) / rig.spacing[a];
            if (!(x >= -2 && x < rig.views[a] + 1)) {
                misses_s = true;
                return;
            }
            const double floor = std::floor(x);
            base[a] = static_cast<int>(floor);
            dual[a] = bell_dual_weights(x - floor);
            for (int i = 0; i < 4; ++i) {
                const int filter = base[a] - 1 + i;
                const double k = (on_m[a] - rig.column_edge(a, filter + 1, 0)) / rig.pixel[a];
                pixel[a][i] = filter >= 0 && filter < rig.views[a] && k >= 0 && k < rig.pixels[a]
                                  ? static_cast<int>(k)
                                  : -1;
            }
        }
    }
    bool exists(const Rig& rig, int axis, int i) const {
        const int filter = base[axis] - 1 + i;
        return filter >= 0 && filter < rig.views[axis];
    }
};

}  // namespace lucerna
