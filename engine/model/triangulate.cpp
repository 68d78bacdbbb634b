// Cuts polygons into triangles by clipping ears [Meisters 1975].
#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/model/model.h"

namespace lucerna {
namespace {

// Projects the corners along the axis nearest to the polygon's normal, so that it runs anticlockwise.
std::vector<V2d> projected(std::span<const V3d> corners) {
    V3d normal(0);  // of the polygon's area, twice
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
    int axis = 0;
    for (const int i : {1, 2}) {
        if (std::fabs(normal[i]) > std::fabs(normal[axis])) axis = i;
    }
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    if (normal[axis] < 0) std::swap(u, v);
    std::vector<V2d> made;
    for (const V3d& corner : corners) made.emplace_back(corner[u] - corners[0][u], corner[v] - corners[0][v]);
    return made;
}

}  // namespace

// Every triangle that is cut off turns to the left. Such triangles cover each point as often as the polygon
// winds around it: a polygon that does not cross itself is covered exactly once, whichever ears are chosen.
std::vector<V3i> triangles_of_polygon(std::span<const V3d> corners) {
    const std::vector<V2d> p = projected(corners);
    const auto area = [&p](const V3i& t) {
        const V2d a = p[static_cast<std::size_t>(t.x)];
        return (p[static_cast<std::size_t>(t.y)] - a).cross(p[static_cast<std::size_t>(t.z)] - a);
    };
    std::vector<int> left(p.size());
    std::iota(left.begin(), left.end(), 0);
    const auto corner = [&left](std::size_t i) {
        const std::size_t n = left.size();
        return V3i(left[(i + n - 1) % n], left[i % n], left[(i + 1) % n]);
    };
    const auto is_ear = [&](const V3i& t) {
        return area(t) > 0 && std::ranges::none_of(left, [&](int q) {
                   return area({t.x, t.y, q}) > 0 && area({t.y, t.z, q}) > 0 && area({t.z, t.x, q}) > 0;
               });
    };
    std::vector<V3i> triangles;
    std::size_t at = 1;
    while (left.size() >= 3) {
        std::size_t tried = 0;
        while (tried < left.size() && !is_ear(corner(at + tried))) ++tried;
        at = (at + tried) % left.size();
        if (tried == left.size()) {
            // Only rounding, or a polygon that crosses itself, leaves no ear: the smallest corner is lost.
            for (std::size_t i = 0; i < left.size(); ++i) {
                if (std::fabs(area(corner(i))) < std::fabs(area(corner(at)))) at = i;
            }
        }
        if (area(corner(at)) != 0) triangles.push_back(corner(at));
        left.erase(left.begin() + static_cast<std::ptrdiff_t>(at));
        if (at == left.size()) at = 0;
    }
    return triangles;
}

}  // namespace lucerna
