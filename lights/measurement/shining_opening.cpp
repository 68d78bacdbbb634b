#include "lights/measurement/shining_opening.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr double kMostLines = 4e6;  // of a slab, at which its radiance is asked

// Light over lines, of a field with radiance as it is emitted.
struct LineSums {
    double over_area = 0;           // ∫ I/A₀ dΦ
    double luminance = 0;           // ∫ L dΦ
    V2d first{0, 0}, second{0, 0};  // ∫ u L dΦ and ∫ u² L dΦ, of places on S

    void add(const LineSums& other) {
        over_area += other.over_area;
        luminance += other.luminance;
        first += other.first;
        second += other.second;
    }
};

class Lamp {
  public:
    Lamp(std::span<const SlabView> slabs, const LuminousOpening& body, const PhotometricWeb& web,
         const Workers& workers)
        : slabs_(slabs), body_(body), web_(web) {
        for (const SlabView& slab : slabs) {
            const double clamped = slab.field.clamped_flux(workers), flux = slab.field.flux();
            emitted_.push_back(clamped > 0 && flux > 0 ? flux / clamped : 0);
        }
    }

    // Over the lines of one interval of S: Gauss's rule over the interval, which is exact for the square of a
    // linear basis, and over every `stride`-th pixel of M.
    LineSums interval(std::size_t i, int n, int o, int stride) const {
        const Rig& rig = slabs_[i].field.rig();
        const bool hats = rig.basis == PixelBasis::hat;
        const std::span<const GaussNode> on_s = gauss_rule(2), on_m = gauss_rule(hats ? 2 : 1);
        LineSums sums;
        for (int p = (hats ? -1 : 0) + stride / 2; p < rig.columns(0); p += stride) {
            for (int q = (hats ? -1 : 0) + stride / 2; q < rig.columns(1); q += stride) {
                for (const GaussNode& s : on_m) {
                    for (const GaussNode& t : on_m) {
                        const V2d m(at_m(rig, 0, n, p + s.x), at_m(rig, 1, o, q + t.x));
                        for (const GaussNode& u : on_s) {
                            for (const GaussNode& v : on_s) {
                                const V2d on(rig.s_coordinate.on_plane(rig.interval_edge_x(0, n) +
                                                                       u.x * rig.spacing.x),
                                             rig.s_coordinate.on_plane(rig.interval_edge_x(1, o) +
                                                                       v.x * rig.spacing.y));
                                add_line(i, on, m, s.weight * t.weight * u.weight * v.weight, sums);
                            }
                        }
                    }
                }
            }
        }
        return sums;
    }

  private:
    // Hats lie between the middles of their pixels.
    static double at_m(const Rig& rig, int axis, int interval, double column) {
        return rig.m_coordinate.on_plane(rig.column_edge_x(axis, interval, 0) +
                                         (column + rig.overhang()) * rig.pixel[axis]);
    }

    void add_line(std::size_t i, const V2d& on_s, const V2d& on_m, double weight, LineSums& sums) const {
        const LightField& field = slabs_[i].field;
        const Rig& rig = field.rig();
        const double own = emitted_[i] * double{field.radiance(on_s, on_m)};
        const double slope = rig.slope(on_s, on_m);
        if (!(own > 0) || !(slope > 0)) return;
        // dΦ = L g du dv ds dt, in the planes' coordinates.
        const double flux = weight * own * rig.geometric_term(on_s, on_m) / slope * rig.cell_volume();
        const V3d through(on_s.x, on_s.y, 0);
        const V3d way = V3d(on_m.x - on_s.x, on_m.y - on_s.y, rig.distance).normalized();
        const V3d o = slabs_[i].axes.to_lamp(through + rig.centre), d = slabs_[i].axes.to_lamp(way);
        const double area = body_.projected_area(d);
        if (!(area > 0)) return;
        double luminance = own;
        for (std::size_t j = 0; j < slabs_.size(); ++j) {
            if (j != i) luminance += radiance(j, o, d);
        }
        sums.over_area += flux * web_.intensity(d) / area;
        sums.luminance += flux * luminance;
        sums.first += flux * luminance * on_s;
        sums.second += flux * luminance * on_s * on_s;
    }

    // Of slab j along the line through o towards d, in the lamp's frame.
    double radiance(std::size_t j, const V3d& o, const V3d& d) const {
        const Rig& rig = slabs_[j].field.rig();
        const V3d way = slabs_[j].axes.to_slab(d), from = slabs_[j].axes.to_slab(o) - rig.centre;
        if (!(way.z > 0)) return 0;
        const V2d slope(way.x / way.z, way.y / way.z);
        const V2d on_s = V2d(from.x, from.y) - from.z * slope;
        return emitted_[j] * double{slabs_[j].field.radiance(on_s, on_s + rig.distance * slope)};
    }

    std::span<const SlabView> slabs_;
    const LuminousOpening& body_;
    const PhotometricWeb& web_;
    std::vector<double> emitted_;  // by which a slab's radiance is scaled to its measured flux
};

int stride_of(const Rig& rig) {
    const double nodes = rig.basis == PixelBasis::hat ? 16 : 4;
    const double lines = nodes * rig.intervals(0) * rig.intervals(1) * rig.columns(0) * rig.columns(1);
    return static_cast<int>(std::ceil(std::max(1.0, std::sqrt(lines / kMostLines))));
}

}  // namespace

LuminousOpening shining_opening(std::span<const SlabView> slabs, const V3d& box, const PhotometricWeb& web,
                                const Workers& workers) {
    const LuminousOpening body(LuminousOpening::Shape::box, box);
    const Lamp lamp(slabs, body, web, workers);
    LineSums sums;
    for (std::size_t i = 0; i < slabs.size(); ++i) {
        const Rig& rig = slabs[i].field.rig();
        const int stride = stride_of(rig);
        const std::int64_t rows = std::int64_t{rig.intervals(0)} * rig.intervals(1);
        std::vector<LineSums> of_rows(static_cast<std::size_t>(rows));
        parallel_chunks(workers, rows, [&](std::int64_t row) {
            of_rows[static_cast<std::size_t>(row)] =
                lamp.interval(i, static_cast<int>(row / rig.intervals(1)),
                              static_cast<int>(row % rig.intervals(1)), stride);
        });
        LineSums all;
        for (const LineSums& row : of_rows) all.add(row);
        // Every stride-th pixel stands for its neighbours, too.
        const double each = double(stride) * stride;
        sums.add({each * all.over_area, each * all.luminance, each * all.first, each * all.second});
    }
    if (!(sums.over_area > 0 && sums.luminance > 0)) return {};
    const double k2 = sums.over_area / sums.luminance;
    if (box.z > 0) return {LuminousOpening::Shape::box, std::sqrt(k2) * box};
    const V2d mean = sums.first / sums.luminance, square = sums.second / sums.luminance;
    const V2d variance = square - mean * mean;
    if (!(variance.x > 0 && variance.y > 0)) return {LuminousOpening::Shape::box, std::sqrt(k2) * box};
    const double area = k2 * box.x * box.y, ratio = std::sqrt(variance.x / variance.y);
    return {LuminousOpening::Shape::box, V3d(std::sqrt(area * ratio), std::sqrt(area / ratio), 0)};
}

}  // namespace lucerna
