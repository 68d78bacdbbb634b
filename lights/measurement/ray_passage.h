// A ray on the two planes of a rig: the filters that weight it and the pixels in which they see it.
#pragma once

#include <array>
#include <cmath>

#include "lights/bell.h"
#include "lights/light_field.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"

namespace lucerna {

inline constexpr double kGrazingRay = 1e-6;  // rays with a smaller d.z do not count as leaving towards +z

// Returns where a ray passes the plane z = height, in the frame of the rays. Requires d.z > 0.
inline V2d pass(const LampRay& ray, double height) {
    const double t = (height - double{ray.o.z}) / double{ray.d.z};
    return {double{ray.o.x} + t * double{ray.d.x}, double{ray.o.y} + t * double{ray.d.y}};
}

struct Passage {
    int base[2];                      // the filter at or below the ray, per axis
    std::array<double, 4> weight[2];  // weights of filters base - 1 ... base + 2
    int pixels;                       // number per axis that share the ray: 1 for boxes, 2 for hats
    int pixel[2][4];                  // the lower of them, in the numbering of each of those filters
    double part[2][2];                // share of each pixel; they add up to 1
    bool misses_s;                    // none of the filters exists

    Passage(const LampRay& ray, const Rig& rig, const RayWeights& weights = {})
        : base{}, pixels(rig.basis == PixelBasis::hat ? 2 : 1), pixel{}, part{}, misses_s(false) {
        const V2d centre(rig.centre.x, rig.centre.y);
        const V2d on_s = pass(ray, rig.centre.z) - centre;
        const V2d on_m = pass(ray, rig.centre.z + rig.distance) - centre;
        for (int a = 0; a < 2; ++a) {
            const double x = rig.intervals_to(a, on_s[a]) - 1;  // in spacings from filter 0
            // The dual extends one interval beyond the bell. In a compressed coordinate the last interval
            // already covers the rest of the plane.
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
    // Returns the b-th pixel in which the i-th filter sees the ray; -1 if there is no such pixel or filter.
    int pixel_of(const Rig& rig, int axis, int i, int b) const {
        const int k = pixel[axis][i] + b;
        return exists(rig, axis, i) && k >= 0 && k < rig.pixels[axis] ? k : -1;
    }
    // Calls visit(filter's i, pixel, weight) for all existing ones along an axis.
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
    // `past` is the distance past filter `base`, in [0, 1) of the spacing.
    void weigh_filters(int axis, double past, double dual) {
        weight[axis] = bell_dual_weights(past);
        if (dual == 1) return;
        for (int i = 0; i < 4; ++i) {
            double& w = weight[axis][static_cast<std::size_t>(i)];
            w = dual * w + (1 - dual) * bell(past + 1 - i);
        }
    }
    // The outermost filters replace those that do not fit on a compressed plane.
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
                                        rig.pixels[axis] + 1.0);  // fits an int, for rays of any slope
            const double floor = std::floor(k);
            pixel[axis][i] = static_cast<int>(floor);
            if (pixels == 1) {
                part[axis][0] = 1;
                continue;
            }
            // The dual of a hat is 2 times it minus its neighbour, over the interval between them.
            const double upper = k - floor, lower = 1 - upper;
            part[axis][0] = (1 + dual) * lower - dual * upper;
            part[axis][1] = (1 + dual) * upper - dual * lower;
            // Beyond the centre of an outermost pixel there is no neighbour to share with.
            if (pixel[axis][i] == -1) part[axis][0] = 0, part[axis][1] = 1;
            if (pixel[axis][i] == rig.pixels[axis] - 1) part[axis][0] = 1, part[axis][1] = 0;
        }
    }
};

}  // namespace lucerna
