#include "lights/measurement/shining_opening.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "lights/gauss.h"

namespace lucerna {
namespace {

constexpr double kMostLines = 4e6;  // along which radiance is evaluated
constexpr double kLeastDirections = 64, kMostDirections = 1024;

// A place on S, and the area around it.
struct Place {
    V2d on_s;
    double area;
};

// The lamp as seen along one direction.
struct View {
    std::size_t slab = 0;          // whose S faces the direction most
    double cosine = 0;             // of the direction's angle with its normal; <= 0: nothing is seen
    std::vector<float> luminance;  // of each of the slab's places
    double intensity = 0;          // ∫ L dA
};

// The luminous part along one direction.
struct Part {
    double area = 0;                // projected
    V2d first{0, 0}, second{0, 0};  // ∫ u dA and ∫ u² dA over it, for positions on S
};

class Lamp {
  public:
    explicit Lamp(std::span<const SlabView> slabs) : slabs_(slabs) {
        for (const SlabView& slab : slabs) places_.push_back(places_on(slab.field.rig()));
    }

    View seen_along(const V3d& d) const {
        View view;
        for (std::size_t j = 1; j < slabs_.size(); ++j)
            if (slabs_[j].axes.n.dot(d) > slabs_[view.slab].axes.n.dot(d)) view.slab = j;
        view.cosine = slabs_[view.slab].axes.n.dot(d);
        if (!(view.cosine > 0)) return view;
        const SlabAxes& axes = slabs_[view.slab].axes;
        for (const Place& place : places_[view.slab]) {
            const V3d from =
                axes.to_lamp(V3d(place.on_s.x, place.on_s.y, 0) + slabs_[view.slab].field.rig().centre);
            double luminance = 0;
            for (const SlabView& slab : slabs_) luminance += radiance(slab, from, d);
            view.luminance.push_back(static_cast<float>(luminance));
            view.intensity += luminance * place.area * view.cosine;
        }
        return view;
    }

    // Takes places in the order of their luminance in the `others`, of the same slab, until they have the
    // luminous share of the light along `view`. A field of few rays is noisy: places in the order of their
    // own luminance would be those where the noise is positive, and too few.
    Part luminous_part(const View& view, std::span<const View* const> others) const {
        const std::vector<Place>& places = places_[view.slab];
        std::vector<float> bright(places.size());
        for (const View* other : others)
            for (std::size_t i = 0; i < bright.size(); ++i) bright[i] += other->luminance[i];
        std::vector<std::size_t> order(places.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::stable_sort(order.begin(), order.end(),
                         [&bright](std::size_t a, std::size_t b) { return bright[a] > bright[b]; });
        Part part;
        double rest = kLuminousShare * view.intensity;
        for (const std::size_t i : order) {
            if (!(rest > 0)) break;
            const double area = places[i].area * view.cosine, light = double{view.luminance[i]} * area;
            const double share = light > rest ? rest / light : 1.0;
            rest -= light;
            part.area += share * area / kLuminousShare;
            part.first += share * area / kLuminousShare * places[i].on_s;
            part.second += share * area / kLuminousShare * places[i].on_s * places[i].on_s;
        }
        return part;
    }

  private:
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
    // Returns the nodes of Gauss's rule over each interval of S.
    static std::vector<Place> places_on(const Rig& rig) {
        std::vector<Place> places;
        const std::vector<Coordinate> us = coordinates(rig, 0), vs = coordinates(rig, 1);
        for (const Coordinate& u : us)
            for (const Coordinate& v : vs) places.push_back({{u.at, v.at}, u.width * v.width});
        return places;
    }

    // Returns the radiance of a slab along the line through `from` towards d, in the lamp's frame. It is
    // negative where the coefficients are, so that noise in the dark adds up to nothing.
    static double radiance(const SlabView& slab, const V3d& from, const V3d& d) {
        const Rig& rig = slab.field.rig();
        const V3d way = slab.axes.to_slab(d), at = slab.axes.to_slab(from) - rig.centre;
        if (!(way.z > 0)) return 0;
        const V2d slope(way.x / way.z, way.y / way.z);
        const V2d on_s = V2d(at.x, at.y) - at.z * slope, on_m = on_s + rig.distance * slope;
        double h = 0;
        slab.field.for_each_pixel(on_s, on_m, [&](const Cell& cell, float x, float y, float weight) {
            h += double{weight * slab.field.members(cell).value(x, y)};
        });
        // The geometric term is 0 for rays that pass M at infinity.
        const double g = rig.geometric_term(on_s, on_m);
        return g > 0 ? h / g : 0;
    }

    std::span<const SlabView> slabs_;
    std::vector<std::vector<Place>> places_;  // of each slab
};

// Returns the views along the directions nearest to direction i, of the same slab and without its own.
std::vector<const View*> neighbours(std::size_t i, std::span<const V3d> directions,
                                    std::span<const View> views) {
    constexpr std::size_t kShare = 8, kLeast = 8;  // one in kShare of all directions, but kLeast
    std::vector<std::pair<double, const View*>> near;
    for (std::size_t j = 0; j < views.size(); ++j)
        if (j != i && views[j].cosine > 0 && views[j].slab == views[i].slab)
            near.emplace_back(-directions[j].dot(directions[i]), &views[j]);
    const std::size_t count = std::min(near.size(), std::max(kLeast, views.size() / kShare));
    std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end(),
                      [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<const View*> result;
    for (std::size_t k = 0; k < count; ++k) result.push_back(near[k].second);
    return result;
}

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
    const Lamp lamp(slabs);
    // Directions are drawn in proportion to intensity, so that narrow beams are hit.
    std::vector<V3d> directions;
    for (std::size_t i = 0, count = directions_for(slabs); i < count; ++i)
        if (const auto drawn = web.draw(lattice(i))) directions.push_back(V3d(drawn->w).normalized());
    std::vector<View> views(directions.size());
    parallel_each(workers, views.size(), 1,
                  [&](std::size_t i) { views[i] = lamp.seen_along(directions[i]); });
    std::vector<Part> parts(views.size());
    parallel_each(workers, parts.size(), 1, [&](std::size_t i) {
        if (views[i].intensity > 0) parts[i] = lamp.luminous_part(views[i], neighbours(i, directions, views));
    });

    double of_body = 0, of_lamp = 0;  // ∫ I²/A dω
    Part all;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const Part& part = parts[i];
        const double area = body.projected_area(directions[i]);
        if (!(part.area > 0 && area > 0)) continue;
        of_body += views[i].intensity / area;
        of_lamp += views[i].intensity / part.area;
        all.area += part.area;
        all.first += part.first;
        all.second += part.second;
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
