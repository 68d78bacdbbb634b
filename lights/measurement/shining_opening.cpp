#include "lights/measurement/shining_opening.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr double kMostLines = 4e6;  // along which radiance is evaluated
constexpr double kLeastDirections = 64, kMostDirections = 1024;

// A place on S, with its luminance and its projected area.
struct Place {
    double luminance, area;
    V2d on_s;
};

// The lamp as seen along one direction.
struct View {
    double intensity = 0;           // ∫ L dA
    double area = 0;                // of the luminous part
    V2d first{0, 0}, second{0, 0};  // ∫ u dA and ∫ u² dA over it, for positions on S
};

class Lamp {
  public:
    Lamp(std::span<const SlabView> slabs, const Workers& workers) : slabs_(slabs) {
        for (const SlabView& slab : slabs) {
            const double clamped = slab.field.clamped_flux(workers), flux = slab.field.flux();
            emitted_.push_back(clamped > 0 && flux > 0 ? flux / clamped : 0);
        }
    }

    View seen_along(const V3d& d) const {
        std::vector<Place> places = places_seen_along(d);
        View view;
        for (const Place& place : places) view.intensity += place.luminance * place.area;
        std::sort(places.begin(), places.end(),
                  [](const Place& a, const Place& b) { return a.luminance > b.luminance; });
        double rest = kLuminousShare * view.intensity;
        for (const Place& place : places) {
            if (!(rest > 0)) break;
            const double share = std::min(1.0, rest / (place.luminance * place.area));
            rest -= place.luminance * place.area;
            view.area += share * place.area / kLuminousShare;
            view.first += share * place.area / kLuminousShare * place.on_s;
            view.second += share * place.area / kLuminousShare * place.on_s * place.on_s;
        }
        return view;
    }

  private:
    // Returns places that shine, on the S that faces d most, by Gauss's rule over each of its intervals.
    std::vector<Place> places_seen_along(const V3d& d) const {
        std::size_t i = 0;
        for (std::size_t j = 1; j < slabs_.size(); ++j)
            if (slabs_[j].axes.n.dot(d) > slabs_[i].axes.n.dot(d)) i = j;
        const Rig& rig = slabs_[i].field.rig();
        const double cosine = slabs_[i].axes.n.dot(d);
        std::vector<Place> places;
        if (!(cosine > 0)) return places;
        const std::vector<Coordinate> us = coordinates(rig, 0), vs = coordinates(rig, 1);
        for (const Coordinate& u : us) {
            for (const Coordinate& v : vs) {
                const V3d on_s(u.at, v.at, 0);
                const V3d from = slabs_[i].axes.to_lamp(on_s + rig.centre);
                double luminance = 0;
                for (std::size_t j = 0; j < slabs_.size(); ++j) luminance += radiance(j, from, d);
                if (luminance > 0) places.push_back({luminance, u.width * v.width * cosine, {u.at, v.at}});
            }
        }
        return places;
    }

    struct Coordinate {
        double at, width;
    };
    static std::vector<Coordinate> coordinates(const Rig& rig, int axis) {
        std::vector<Coordinate> all;
        for (int n = 0; n < rig.intervals(axis); ++n) {
            for (const GaussNode& node : gauss_rule(2)) {
                const double at =
                    rig.s_coordinate.on_plane(rig.interval_edge_x(axis, n) + node.x * rig.spacing[axis]);
                const double slope = rig.s_coordinate.slope(at);
                if (slope > 0) all.push_back({at, node.weight * rig.spacing[axis] / slope});
            }
        }
        return all;
    }

    // Returns the radiance of slab j along the line through `from` towards d, in the lamp's frame.
    double radiance(std::size_t j, const V3d& from, const V3d& d) const {
        const Rig& rig = slabs_[j].field.rig();
        const V3d way = slabs_[j].axes.to_slab(d), at = slabs_[j].axes.to_slab(from) - rig.centre;
        if (!(way.z > 0)) return 0;
        const V2d slope(way.x / way.z, way.y / way.z);
        const V2d on_s = V2d(at.x, at.y) - at.z * slope;
        return emitted_[j] * double{slabs_[j].field.radiance(on_s, on_s + rig.distance * slope)};
    }

    std::span<const SlabView> slabs_;
    std::vector<double> emitted_;  // factors from a slab's radiance to its measured flux
};

// Returns the number of directions, limited by kMostLines; a slab's S has four places in each interval.
std::size_t directions_for(std::span<const SlabView> slabs) {
    double places = 0;
    for (const SlabView& slab : slabs) {
        const Rig& rig = slab.field.rig();
        places += 4.0 * rig.intervals(0) * rig.intervals(1);
    }
    return static_cast<std::size_t>(std::clamp(kMostLines / places, kLeastDirections, kMostDirections));
}

// Returns the points of a lattice with uniform projections, from the plastic number [Roberts 2018].
V2f lattice(std::size_t i) {
    const double x = 0.5 + 0.7548776662466927 * static_cast<double>(i);
    const double y = 0.5 + 0.5698402909980532 * static_cast<double>(i);
    return V2f(static_cast<float>(x - std::floor(x)), static_cast<float>(y - std::floor(y)));
}

}  // namespace

LuminousOpening shining_opening(std::span<const SlabView> slabs, const V3d& box, const PhotometricWeb& web,
                                const Workers& workers) {
    const LuminousOpening body(LuminousOpening::Shape::box, box);
    const Lamp lamp(slabs, workers);
    // Directions are drawn in proportion to intensity, so that narrow beams are hit.
    std::vector<V3d> directions;
    for (std::size_t i = 0, count = directions_for(slabs); i < count; ++i)
        if (const auto drawn = web.draw(lattice(i))) directions.push_back(V3d(drawn->w).normalized());
    std::vector<View> views(directions.size());
    parallel_each(workers, views.size(), 1,
                  [&](std::size_t i) { views[i] = lamp.seen_along(directions[i]); });

    double of_body = 0, of_lamp = 0;  // ∫ I²/A dω
    View all;
    for (std::size_t i = 0; i < views.size(); ++i) {
        const View& view = views[i];
        const double area = body.projected_area(directions[i]);
        if (!(view.area > 0 && area > 0)) continue;
        of_body += view.intensity / area;
        of_lamp += view.intensity / view.area;
        all.area += view.area;
        all.first += view.first;
        all.second += view.second;
    }
    if (!(of_lamp > 0)) return {};
    const double k2 = of_body / of_lamp;
    const V2d mean = all.first / all.area, variance = all.second / all.area - mean * mean;
    if (box.z > 0 || !(variance.x > 0 && variance.y > 0))
        return {LuminousOpening::Shape::box, std::sqrt(k2) * box};
    const double area = k2 * box.x * box.y, ratio = std::sqrt(variance.x / variance.y);
    return {LuminousOpening::Shape::box, V3d(std::sqrt(area * ratio), std::sqrt(area / ratio), 0)};
}

}  // namespace lucerna
