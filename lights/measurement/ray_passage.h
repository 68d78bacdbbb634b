// A ray of a ray set on the two planes of a rig: which filters weigh it, and which pixels they see it in.
#pragma once

#include <array>
#include <cmath>

#include "lights/bell.h"
#include "lights/light_field.h"
#include "lights/ray_set.h"

namespace lucerna {

inline constexpr double kGrazing = 1e-6;  // rays with a smaller d.z do not leave towards +z

// Where a ray passes the plane z = height, in the frame of the rays. d.z > 0.
inline V2d pass(const LampRay& ray, double height) {
    const double t = (height - double{ray.o.z}) / double{ray.d.z};
    return {double{ray.o.x} + t * double{ray.d.x}, double{ray.o.y} + t * double{ray.d.y}};
}

// One ray, on the rig's planes.
struct Passage {
    int base[2];                    // the filter at or below it, per axis
    double past[2];                 // how far past that filter it lies, in [0, 1) of the spacing
    std::array<double, 4> dual[2];  // of filters base - 1 ... base + 2
    int pixel[2][4];                // the pixel each of those sees it in; -1: none, or no such filter
    bool misses_s;                  // none of the filters exists

    Passage(const LampRay& ray, const Rig& rig) : base{}, past{}, pixel{}, misses_s(false) {
        const V2d centre(rig.centre.x, rig.centre.y);
        const V2d on_s = pass(ray, rig.centre.z) - centre;
        const V2d on_m = pass(ray, rig.centre.z + rig.distance) - centre;
        for (int a = 0; a < 2; ++a) {
            const double x = (on_s[a] - rig.filter(a, 0)) / rig.spacing[a];
            if (!(x >= -2 && x < rig.views[a] + 1)) {
                misses_s = true;
                return;
            }
            const double floor = std::floor(x);
            base[a] = static_cast<int>(floor);
            past[a] = x - floor;
            dual[a] = bell_dual_weights(past[a]);
            for (int i = 0; i < 4; ++i) {
                const double k = (on_m[a] - rig.column_edge(a, base[a] + i, 0)) / rig.pixel[a];
                const bool seen = exists(rig, a, i) && k >= 0 && k < rig.pixels[a];
                pixel[a][i] = seen ? static_cast<int>(k) : -1;
            }
        }
    }
    // Φ over the ray of the i-th of those filters.
    double bell_at(int axis, int i) const { return bell(past[axis] + 1 - i); }
    bool exists(const Rig& rig, int axis, int i) const {
        const int filter = base[axis] - 1 + i;
        return filter >= 0 && filter < rig.views[axis];
    }
};

}  // namespace lucerna
