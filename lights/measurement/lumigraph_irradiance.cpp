// The irradiance that the slabs of a lamp cast together on a plane beside it.
#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "lights/measurement/basis_shares.h"
#include "lights/measurement/plane_irradiance.h"

namespace lucerna {
namespace {

constexpr double kSameAxis = 1e-6;
constexpr int kSamples = 256;  // samples per axis of a plane, at least, over which pixels' means are taken
constexpr int kMostPerPixel = 8;
constexpr int kCoarse = 64;        // pixels per side of the projection from which a frame is found
constexpr double kFrameSlope = 3;  // half size of a frame over its distance, at most

double along(const V3d& a, const V3d& b) {
    return a.dot(b);
}
bool parallel(const V3d& a, const V3d& b) {
    return std::fabs(std::fabs(along(a, b)) - 1) < kSameAxis;
}

// A slab whose normal is parallel to the plane.
struct SideView {
    const LightField& field;
    int up;              // axis of S along the plane's normal; the other one is parallel to the plane
    double normal_sign;  // direction of the plane's normal along it
    double at_up;        // position of the plane along it [m, from S's centre]
    int deep, wide;      // axes of the plane along the slab's normal, and along S's other axis
    double deep_sign, wide_sign;
    bool before_s;  // counts light that has not passed S yet, too

    const Rig& rig() const { return field.rig(); }
    int other() const { return 1 - up; }

    // Returns the shares of S's axis along the plane's normal, the same for all points at one depth.
    std::vector<BasisShare> facing_shares(double z) const {
        const double ratio = rig().distance / z;
        return basis_shares(rig(), up, at_up * ratio, 1 - ratio, FacingWeight{at_up, normal_sign / z});
    }
    std::vector<BasisShare> plain_shares(double z, double at) const {
        const double ratio = rig().distance / z;
        return basis_shares(rig(), other(), at * ratio, 1 - ratio);
    }

    // Sums over filters and pixels of the facing axis; the rest depends on the other axis alone.
    std::vector<double> contracted(double z) const {
        const auto height = static_cast<std::size_t>(rig().pixels[other()]);
        std::vector<double> rest(static_cast<std::size_t>(rig().views[other()]) * height);
        for (const BasisShare& share : facing_shares(z)) {
            for (int n = 0; n < rig().views[other()]; ++n) {
                for (int l = 0; l < rig().pixels[other()]; ++l) {
                    const std::size_t i = up == 0 ? rig().index(share.filter, n, share.pixel, l)
                                                  : rig().index(n, share.filter, l, share.pixel);
                    rest[static_cast<std::size_t>(n) * height + static_cast<std::size_t>(l)] +=
                        share.weight * double{field.coefficients()[i]};
                }
            }
        }
        return rest;
    }
    double irradiance(double z, double at, const std::vector<double>& rest) const {
        const auto height = static_cast<std::size_t>(rig().pixels[other()]);
        double sum = 0;
        for (const BasisShare& share : plain_shares(z, at)) {
            sum +=
                share.weight *
                rest[static_cast<std::size_t>(share.filter) * height + static_cast<std::size_t>(share.pixel)];
        }
        return sum * (rig().distance / z) * (rig().distance / z);
    }
};

double place(const PlanePatch& patch, int axis, double pixel) {
    return patch.centre[axis] + (pixel / patch.pixels[axis] - 0.5) * patch.size[axis];
}

void add_side_view(const SideView& view, const PlanePatch& patch, const V3d& centre, const Workers& workers,
                   Monitor& monitor, std::vector<double>& values) {
    const int deep_pixels = patch.pixels[view.deep], wide_pixels = patch.pixels[view.wide];
    const auto samples = [](int pixels) { return std::clamp(kSamples / pixels, 1, kMostPerPixel); };
    const int deep_samples = samples(deep_pixels), wide_samples = samples(wide_pixels);
    parallel_chunks(workers, deep_pixels, [&](std::int64_t row) {
        if (monitor.stopped()) throw Stopped("projection: stopped");
        for (int i = 0; i < deep_samples; ++i) {
            const double depth = place(patch, view.deep, static_cast<double>(row) + (i + 0.5) / deep_samples);
            const double z = view.deep_sign * depth - centre.z;
            if (z == 0 || (z < 0 && !view.before_s)) continue;
            const std::vector<double> rest = view.contracted(z);
            if (std::all_of(rest.begin(), rest.end(), [](double e) { return e == 0; })) continue;
            for (int column = 0; column < wide_pixels; ++column) {
                double sum = 0;
                for (int k = 0; k < wide_samples; ++k) {
                    const double at =
                        view.wide_sign * place(patch, view.wide, column + (k + 0.5) / wide_samples) -
                        (view.other() == 0 ? centre.x : centre.y);
                    sum += view.irradiance(z, at, rest);
                }
                const auto x = static_cast<std::size_t>(view.deep == 0 ? row : column);
                const auto y = static_cast<std::size_t>(view.deep == 0 ? column : row);
                values[y * static_cast<std::size_t>(patch.pixels.x) + x] +=
                    sum / (deep_samples * wide_samples);
            }
        }
    });
}

SideView side_view(const Slab& slab, const SlabAxes& side, double distance, bool before_s) {
    const V3d& centre = slab.field.rig().centre;
    SideView view{slab.field,
                  parallel(slab.axes.u, side.n) ? 0 : 1,
                  0,
                  0,
                  parallel(slab.axes.n, side.u) ? 0 : 1,
                  0,
                  0,
                  0,
                  before_s};
    view.wide = 1 - view.deep;
    const V3d& up = view.up == 0 ? slab.axes.u : slab.axes.v;
    const V3d& other = view.up == 0 ? slab.axes.v : slab.axes.u;
    const V3d& deep = view.deep == 0 ? side.u : side.v;
    const V3d& wide = view.deep == 0 ? side.v : side.u;
    if (!parallel(up, side.n) || !parallel(slab.axes.n, deep) || !parallel(other, wide)) {
        throw InputError(
            fmt::format("plane: the slab towards {} is not aligned with its axes", slab.axes.name()));
    }
    view.normal_sign = std::copysign(1.0, along(up, side.n));
    view.at_up = view.normal_sign * distance - (view.up == 0 ? centre.x : centre.y);
    view.deep_sign = std::copysign(1.0, along(slab.axes.n, deep));
    view.wide_sign = std::copysign(1.0, along(other, wide));
    return view;
}

}  // namespace

PlaneIrradiance project(const Lumigraph& lamp, const SlabAxes& side, const PlanePatch& patch,
                        const Workers& workers, Monitor& monitor) {
    if (const std::string fault = patch.fault(); !fault.empty()) throw InputError("plane: " + fault);
    if (!lamp.simple()) {
        double front = -INFINITY;
        for (int corner = 0; corner < 8; ++corner)
            front = std::max(front, side.n.dot(box_corner(lamp.box(), corner)));
        if (!(patch.distance >= front)) {
            throw InputError(fmt::format(
                "plane: it intersects the lamp's box; expected {:g} m or more along {}", front, side.name()));
        }
    }
    PlaneIrradiance all{patch, {}};
    all.values.resize(static_cast<std::size_t>(patch.pixels.x) * static_cast<std::size_t>(patch.pixels.y));
    for (const Slab& slab : lamp.slabs()) {
        const V3d& centre = slab.field.rig().centre;
        const double cosine = along(slab.axes.n, side.n);
        if (cosine < -1 + kSameAxis) continue;  // it looks the other way
        if (cosine > 1 - kSameAxis) {
            if (!(along(slab.axes.u, side.u) > 1 - kSameAxis)) {
                throw InputError(
                    fmt::format("plane: the slab towards {} is not aligned with its axes", slab.axes.name()));
            }
            PlanePatch moved = patch;
            moved.distance = std::max(0.0, patch.distance - centre.z);
            moved.centre -= V2d(centre.x, centre.y);
            const PlaneIrradiance one = project(slab.field, moved, workers, monitor);
            for (std::size_t i = 0; i < one.values.size(); ++i) all.values[i] += one.values[i];
            continue;
        }
        add_side_view(side_view(slab, side, patch.distance, !lamp.simple()), patch, centre, workers, monitor,
                      all.values);
    }
    return all;
}

PlanePatch frame_light(const Lumigraph& lamp, const SlabAxes& side, double distance, int pixels,
                       const Workers& workers, Monitor& monitor) {
    const V3d middle = lamp.simple() ? lamp.slabs()[0].field.rig().centre : lamp.box().center();
    const double size = lamp.simple() ? 0.0 : lamp.box().size().length();
    PlanePatch wide;
    wide.distance = distance;
    wide.centre = V2d(middle.dot(side.u), middle.dot(side.v));
    wide.size = V2d(std::max(1e-9, size + 2 * kFrameSlope * std::fabs(distance - middle.dot(side.n))));
    wide.pixels = V2i(kCoarse);
    return frame_of(project(lamp, side, wide, workers, monitor), pixels);
}

}  // namespace lucerna
