// A ray on the two planes of a rig: the filters that weight it and the pixels in which they see it.
#pragma once

#include <array>
#include <cmath>
#include <optional>

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
        : Passage(pass(ray, rig.centre.z) - V2d(rig.centre.x, rig.centre.y),
                  pass(ray, rig.centre.z + rig.distance) - V2d(rig.centre.x, rig.centre.y), rig, weights) {}
    // Places on the planes are relative to the rig's centre.
    Passage(const V2d& on_s, const V2d& on_m, const Rig& rig, const RayWeights& weights)
        : base{}, pixels(rig.basis == PixelBasis::hat ? 2 : 1), pixel{}, part{}, misses_s(false) {
        for (int a = 0; a < 2; ++a) {
            const double x = spacings_to(a, on_s[a], rig);
            if (std::isnan(x)) {
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

    // Returns `base` alone; nothing if the ray misses S.
    static std::optional<V2i> square_of(const LampRay& ray, const Rig& rig) {
        const V2d on_s = pass(ray, rig.centre.z) - V2d(rig.centre.x, rig.centre.y);
        const V2d at(spacings_to(0, on_s.x, rig), spacings_to(1, on_s.y, rig));
        if (std::isnan(at.x) || std::isnan(at.y)) return {};
        return V2i(static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y)));
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

    // The coefficients that record a ray. The index of each is a sum of one part per axis, and so is its
    // weight a product.
    struct Record {
        int count[2] = {0, 0};
        std::size_t index[2][8];
        double weight[2][8];

        template <typename Sum>
        void add(double light, std::vector<Sum>& sums) const {
            for (int i = 0; i < count[0]; ++i) {
                const double across = light * weight[0][i];
                for (int j = 0; j < count[1]; ++j)
                    sums[index[0][i] + index[1][j]] += static_cast<Sum>(across * weight[1][j]);
            }
        }
    };
    // index_along(axis, filter, pixel) is the part of an index along an axis.
    template <typename IndexAlong>
    Record record(const Rig& rig, IndexAlong&& index_along) const {
        Record made;
        for (int a = 0; a < 2; ++a) {
            for_each(rig, a, [&](int i, int k, double w) {
                made.index[a][made.count[a]] = index_along(a, base[a] - 1 + i, k);
                made.weight[a][made.count[a]++] = w;
            });
        }
        return made;
    }

  private:
    // Returns the place on S in spacings from filter 0; NaN where no filter weights light.
    static double spacings_to(int axis, double on_s, const Rig& rig) {
        const double x = rig.intervals_to(axis, on_s) - 1;
        // The dual extends one interval beyond the bell. In a compressed coordinate the last interval already
        // covers the rest of the plane.
        const double beyond = rig.s_coordinate.c > 0 ? 0 : 1;
        return x >= -1 - beyond && x < rig.views[axis] + beyond ? x : NAN;
    }
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
            if (i > 0 && rig.shift[axis] == 0) {  // all filters see the same pixels
                pixel[axis][i] = pixel[axis][0];
                continue;
            }
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
