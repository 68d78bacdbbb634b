#include "engine/photometry/floors.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>

#include "engine/base/elementary.h"
#include "engine/photometry/edge_between.h"

namespace lucerna {
namespace {

constexpr int kLines = 128;           // grid lines along each side of the model
constexpr double kHeadroom = 2;       // m
constexpr double kSameHeight = 0.05;  // m
constexpr double kLeastShare = 0.05;  // of the area of the model's plan
const double kLevel = cos(3 * kPiD / 180);

struct Place {
    double height;
    V3d at;
    bool under_sky;
};

// Adds, from the top down, the level surfaces with headroom that the vertical line through `top` meets.
void add_places(const Scene& scene, int up, const V3f& top, float depth, std::vector<Place>& places) {
    V3f down(0);
    down[up] = -1;
    Ray ray{top, down, depth};
    const float step = surface_error(V3f(diagonal(scene)), diagonal(scene));
    float above = INFINITY;  // height of the surface above
    while (ray.t_max > 0) {
        const auto hit = scene.intersect(ray);
        if (!hit) return;
        const float height = hit->at.p[up];
        if (double{above - height} >= kHeadroom && std::fabs(double{hit->at.n[up]}) >= kLevel)
            places.push_back({double{height}, V3d(hit->at.p), std::isinf(above)});
        above = height;
        ray.o[up] = height - step;
        ray.t_max = depth - (top[up] - ray.o[up]);
    }
}

// Returns how far a floor continues from a place along d (unit, level), at most `most` [m]. Beyond a roof's
// edge begins another.
double reach(const Scene& scene, int up, const Place& place, const V3d& d, double most) {
    constexpr double kExact = 1e-4;  // m
    V3f down(0);
    down[up] = -1;
    const auto continues = [&](double distance) {
        const V3f from = V3f(place.at + distance * d) - static_cast<float>(kSameHeight) * down;
        const auto hit = scene.intersect(Ray{from, down, static_cast<float>(2 * kSameHeight)});
        if (!hit || !(std::fabs(double{hit->at.n[up]}) >= kLevel)) return false;
        return place.under_sky != scene.intersect(Ray{from, -down}).has_value();
    };
    return edge_between(0, most, kExact, continues).inside;
}

// Returns the bounds in plan of places of one floor, which are `cell` apart along each axis. Between the
// outermost places and the next ones, where there is no floor, its sides are found exactly.
Imath::Box<V3d> bounds_of(const Scene& scene, int up, std::span<const Place> places, const V3d& cell) {
    constexpr double kOuter = 0.01;  // of a cell
    Imath::Box<V3d> inner;
    for (const Place& place : places) inner.extendBy(place.at);
    Imath::Box<V3d> box = inner;
    for (const int side : {(up + 1) % 3, (up + 2) % 3}) {
        for (const double sign : {-1.0, 1.0}) {
            const double last = sign > 0 ? inner.max[side] : inner.min[side];
            V3d d(0);
            d[side] = sign;
            double most = 0;
            for (const Place& place : places) {
                if (std::fabs(place.at[side] - last) > kOuter * cell[side]) continue;
                most = std::max(most, reach(scene, up, place, d, cell[side]));
            }
            (sign > 0 ? box.max : box.min)[side] += sign * most;
        }
    }
    return box;
}

// Tells whether a place is the roof over a floor: it is under the sky and within the floor's bounds in plan.
bool is_roof(const Place& place, std::span<const Floor> floors, const Scene& scene, int up) {
    if (!place.under_sky) return false;
    const V3d at = place.at + scene.origin();
    const int a = (up + 1) % 3, b = (up + 2) % 3;
    return std::any_of(floors.begin(), floors.end(), [&](const Floor& floor) {
        return at[a] >= floor.least[a] && at[a] <= floor.most[a] && at[b] >= floor.least[b] &&
               at[b] <= floor.most[b];
    });
}

}  // namespace

std::vector<Floor> floors_of(const Scene& scene, int up_axis) {
    const Box3f bounds = scene.bounds();
    if (bounds.isEmpty()) return {};
    const int a = (up_axis + 1) % 3, b = (up_axis + 2) % 3;
    const V3f size = bounds.size();
    const float depth = 1.01F * size[up_axis] + 1;
    std::vector<Place> places;
    for (int i = 0; i < kLines; ++i) {
        for (int j = 0; j < kLines; ++j) {
            // Keeps lines away from the cells' centres, because models have edges at round numbers.
            V3f top = bounds.min;
            top[a] += size[a] * (static_cast<float>(i) + 0.5123F) / kLines;
            top[b] += size[b] * (static_cast<float>(j) + 0.4871F) / kLines;
            top[up_axis] = bounds.max[up_axis] + 0.005F * size[up_axis] + 0.5F;
            add_places(scene, up_axis, top, depth, places);
        }
    }
    std::sort(places.begin(), places.end(),
              [](const Place& p, const Place& q) { return p.height < q.height; });
    const double cell = double{size[a]} * double{size[b]} / (kLines * kLines);
    std::vector<Floor> floors;
    for (std::size_t first = 0, end = 0; first < places.size();) {
        while (end < places.size() && places[end].height < places[first].height + kSameHeight) ++end;
        const double lowest = places[first].height + scene.origin()[up_axis];
        if (!floors.empty() && lowest < floors.back().height + kHeadroom) {
            ++first;
            continue;
        }
        std::vector<Place> level;
        std::copy_if(places.begin() + static_cast<std::ptrdiff_t>(first),
                     places.begin() + static_cast<std::ptrdiff_t>(end), std::back_inserter(level),
                     [&](const Place& place) { return !is_roof(place, floors, scene, up_axis); });
        const auto count = static_cast<double>(level.size());
        if (count < kLeastShare * kLines * kLines) {
            ++first;
            continue;
        }
        Floor& floor = floors.emplace_back();
        floor.area = count * cell;
        Imath::Box<V3d> box = bounds_of(scene, up_axis, level, V3d(size) / double{kLines});
        box.min[up_axis] = box.max[up_axis] = level[level.size() / 2].height;  // median height
        floor.least = box.min + scene.origin();
        floor.most = box.max + scene.origin();
        floor.height = floor.least[up_axis];
        first = end;
    }
    return floors;
}

}  // namespace lucerna
