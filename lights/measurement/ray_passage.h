// A ray of a ray set on the two planes of a rig: which filters weigh it, and which pixels they see it in.
#pragma once

#include <array>
#include <cmath>

#include "lights/bell.h"
#include "lights/light_field.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"

namespace lucerna {

inline constexpr double kGrazingRay = 1e-6;  // rays with a smaller d.z do not leave towards +z

// Where a ray passes the plane z = height, in the frame of the rays. d.z > 0.
inline V2d pass(const LampRay& ray, double height) {
    const double t = (height - double{ray.o.z}) / double{ray.d.z};
    return {double{ray.o.x} + t * double{ray.d.x}, double{ray.o.y} + t * double{ray.d.y}};
}

// One ray, on the rig's planes.
struct Passage {
    int base[2];                      // the filter at or below it, per axis
    std::array<double, 4> weight[2];  // of filters base - 1 ... base + 2
    int pixels;                       // per axis, that take a part of it: 1 of boxes, 2 of hats
    int pixel[2][4];                  // the lower of them, as each of those filters numbers its own
    double part[2][2];                // what each pixel takes; 1 together
    bool misses_s;                    // none of the filters exists

    Passage(const LampRay& ray, const Rig& rig, const RayWeights& weights = {})
        : base{}, pixels(rig.basis == PixelBasis::hat ? 2 : 1), pixel{}, part{}, misses_s(false) {
        const V2d centre(rig.centre.x, rig.centre.y);
        const V2d on_s = pass(ray, rig.centre.z) - centre;
        const V2d on_m = pass(ray, rig.centre.z + rig.distance) - centre;
        for (int a = 0; a < 2; ++a) {
            const double x = rig.intervals_to(a, on_s[a]) - 1;  // in spacings from filter 0
            // The dual reaches an interval farther than the bell. Where a coordinate compresses, that
            // interval is all the rest of the plane.
            const double beyond = rig.s_coordinate.c > 0 ? 0 : 1;
            if (!(x >= -1 - beyond && x < rig.views[a] + beyond)) {
                misses_s = true;
                return;
            }
            const double floor = std::floor(x);
            base[a] = static_cast<int>(floor);
            weigh_filters(a, x - floor, weights.dual_s);
            if (rig.s_coordinate.c > 0) fold_missing_filters(a, rig);
            find_pixels(a, on_m[a], rig, weights.dual_m);
        }
    }

    bool exists(const Rig& rig, int axis, int i) const {
        const int filter = base[axis] - 1 + i;
        return filter >= 0 && filter < rig.views[axis];
    }
    // The b-th pixel in which the i-th filter sees it; -1: none, or no such filter.
    int pixel_of(const Rig& rig, int axis, int i, int b) const {
        const int k = pixel[axis][i] + b;
        return exists(rig, axis, i) && k >= 0 && k < rig.pixels[axis] ? k : -1;
    }
    // Calls visit(filter's i, pixel, weight) for all of an axis that there are.
    template <typename Visit>
    void for_each(const Rig& rig, int axis, Visit&& visit) const {
        for (int i = 0; i < 4; ++i) {
            for (int b = 0; b < pixels; ++b) {
                const int k = pixel_of(rig, axis, i, b);
                if (k >= 0) visit(i, k, weight[axis][static_cast<std::size_t>(i)] * part[axis][b]);
            }
        }
    }

  private:
    // `past`: how far past filter `base`, in [0, 1) of the spacing.
    void weigh_filters(int axis, double past, double dual) {
        weight[axis] = bell_dual_weights(past);
        if (dual == 1) return;
        for (int i = 0; i < 4; ++i) {
            double& w = weight[axis][static_cast<std::size_t>(i)];
            w = dual * w + (1 - dual) * bell(past + 1 - i);
        }
    }
    // The outermost filters stand for those that a compressed plane has no room for.
    void fold_missing_filters(int axis, const Rig& rig) {
        std::array<double, 4>& w = weight[axis];
        for (int i = 0; i < 4; ++i) {
            const int nearest = std::clamp(base[axis] - 1 + i, 0, rig.views[axis] - 1) - base[axis] + 1;
            if (nearest == i) continue;
            w[static_cast<std::size_t>(nearest)] += w[static_cast<std::size_t>(i)];
            w[static_cast<std::size_t>(i)] = 0;
        }
    }
    void find_pixels(int axis, double on_m, const Rig& rig, double dual) {
        const double overhang = rig.overhang();
        for (int i = 0; i < 4; ++i) {
            const double k = std::clamp(rig.columns_to(axis, base[axis] + i, on_m) - overhang, -2.0,
                                        rig.pixels[axis] + 1.0);  // as an int, for rays of any slope
            const double floor = std::floor(k);
            pixel[axis][i] = static_cast<int>(floor);
            if (pixels == 1) {
                part[axis][0] = 1;
                continue;
            }
            // The dual of a hat: 2 of its own less 1 of the neighbour's, over the interval between them.
            const double upper = k - floor, lower = 1 - upper;
            part[axis][0] = (1 + dual) * lower - dual * upper;
            part[axis][1] = (1 + dual) * upper - dual * lower;
            // Beyond the middle of an outermost pixel there is no other to share with.
            if (pixel[axis][i] == -1) part[axis][0] = 0, part[axis][1] = 1;
            if (pixel[axis][i] == rig.pixels[axis] - 1) part[axis][0] = 1, part[axis][1] = 0;
        }
    }
};

}  // namespace lucerna
