#include "lights/measurement/rectification.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace lucerna {
namespace {

double cross(const V2d& a, const V2d& b) {
    return a.x * b.y - a.y * b.x;
}

// A polygon of a few corners: a quadrilateral cut by four lines has at most eight.
struct Polygon {
    std::array<V2d, 8> p;
    int n = 0;
    void add(const V2d& q) { p[static_cast<std::size_t>(n++)] = q; }
};

// Returns the part with sign · (its coordinate `axis` - at) >= 0 [Sutherland and Hodgman 1974].
Polygon cut(const Polygon& polygon, int axis, double at, double sign) {
    Polygon kept;
    for (int i = 0; i < polygon.n; ++i) {
        const V2d& a = polygon.p[static_cast<std::size_t>(i)];
        const V2d& b = polygon.p[static_cast<std::size_t>((i + 1) % polygon.n)];
        const double da = sign * (a[axis] - at), db = sign * (b[axis] - at);
        if (da >= 0 && kept.n < 8) kept.add(a);
        if (((da > 0 && db < 0) || (da < 0 && db > 0)) && kept.n < 8)
            kept.add(a + (b - a) * (da / (da - db)));  // da and db have opposite signs, so da ≠ db
    }
    return kept;
}

double area(const Polygon& polygon) {
    double twice = 0;
    for (int i = 1; i + 1 < polygon.n; ++i) {
        const V2d& o = polygon.p[0];
        twice +=
            cross(polygon.p[static_cast<std::size_t>(i)] - o, polygon.p[static_cast<std::size_t>(i + 1)] - o);
    }
    return 0.5 * std::fabs(twice);
}

// Returns the area of a convex quadrilateral within the box [low, high].
double area_within(const std::array<V2d, 4>& quad, const V2d& low, const V2d& high) {
    Polygon polygon;
    for (const V2d& p : quad) polygon.add(p);
    for (int axis = 0; axis < 2; ++axis) {
        polygon = cut(polygon, axis, low[axis], 1);
        polygon = cut(polygon, axis, high[axis], -1);
    }
    return area(polygon);
}

std::array<V2d, 4> box_corners(const V2d& low, const V2d& high) {
    return {low, V2d(high.x, low.y), high, V2d(low.x, high.y)};
}

// Returns true if all sides turn the same way, by more than rounding.
bool convex(const std::array<V2d, 4>& q) {
    double size = 0;
    for (const V2d& p : q) size = std::max(size, (p - q[0]).length2());
    double sign = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        const double turn = cross(q[(i + 1) % 4] - q[i], q[(i + 2) % 4] - q[(i + 1) % 4]);
        if (!(std::fabs(turn) > 1e-9 * size)) return false;  // also refuses NaN
        if (sign * turn < 0) return false;
        sign = turn > 0 ? 1 : -1;
    }
    return true;
}

}  // namespace

Homography Homography::of_rectangle(const V2d& size, const std::array<V2d, 4>& to) {
    if (!convex(to)) {
        throw InputError(
            fmt::format("the corners ({:g}, {:g}), ({:g}, {:g}), ({:g}, {:g}), ({:g}, {:g}) do not form a "
                        "convex quadrilateral; expected the four corners in order around it",
                        to[0].x, to[0].y, to[1].x, to[1].y, to[2].x, to[2].y, to[3].x, to[3].y));
    }
    // The formulas are those of [Heckbert 1989, 2.2.3].
    const V2d sum = to[0] - to[1] + to[2] - to[3];
    const V2d a = to[1] - to[2], b = to[3] - to[2];
    const double below = cross(a, b);  // not 0, because the quadrilateral is convex
    const double g = cross(sum, b) / below, h = cross(a, sum) / below;
    const V2d row0 = (to[1] - to[0] + g * to[1]) / size.x, row1 = (to[3] - to[0] + h * to[3]) / size.y;
    Homography map;
    map.m_ = Imath::M33d(row0.x, row0.y, g / size.x, row1.x, row1.y, h / size.y, to[0].x, to[0].y, 1);
    map.inside_ = 0.5 * size;
    return map;
}

V2d Homography::operator()(const V2d& p) const {
    const double w = weight(p);  // > 0 for points that it reaches, which the caller ensures
    return {(p.x * m_[0][0] + p.y * m_[1][0] + m_[2][0]) / w,
            (p.x * m_[0][1] + p.y * m_[1][1] + m_[2][1]) / w};
}

Homography Homography::inverse() const {
    Homography map;
    map.m_ = m_.inverse();
    map.inside_ = (*this)(inside_);
    // A homography is defined up to a factor, whose sign makes weights positive on the rectangle's side.
    if (map.weight(map.inside_) < 0) map.m_ *= -1.0;
    return map;
}

Corners corners_of_crop(const V2d& upper_left, const V2d& size) {
    const V2d low(upper_left.x, upper_left.y + size.y);
    return {low, low + V2d(size.x, 0), upper_left + V2d(size.x, 0), upper_left};
}

AreaMap::AreaMap(const Grid& target, const Grid& source, const Homography& to_source)
    : first_(target.cells() + 1), used_(source.cells(), false) {
    const Homography to_target = to_source.inverse();
    // Cells are added in the order of their layout, so that first_ ascends.
    const int outer = target.columns ? target.size.x : target.size.y;
    const int inner = target.columns ? target.size.y : target.size.x;
    for (int a = 0; a < outer; ++a) {
        for (int b = 0; b < inner; ++b) {
            const V2i cell = target.columns ? V2i(a, b) : V2i(b, a);
            add_cell(source, cell, to_source, to_target);
            first_[target.index(cell.x, cell.y) + 1] = shares_.size();
        }
    }
}

void AreaMap::add_cell(const Grid& source, const V2i& cell, const Homography& to_source,
                       const Homography& to_target) {
    constexpr double kLeast = 1e-9;  // smaller shares are rounding errors
    const V2d low(cell), high(cell.x + 1, cell.y + 1);
    // The source cells that may cover the cell lie in the bounding box of its image.
    V2d from(source.size), to(0, 0);
    for (const V2d& corner : box_corners(low, high)) {
        if (!to_source.reaches(corner)) return;
        const V2d at = to_source(corner);
        for (int axis = 0; axis < 2; ++axis) {
            from[axis] = std::min(from[axis], at[axis]);
            to[axis] = std::max(to[axis], at[axis]);
        }
    }
    V2i begin, end;
    for (int axis = 0; axis < 2; ++axis) {  // clamped as doubles, because distant values exceed an int
        begin[axis] = static_cast<int>(std::floor(std::clamp(from[axis], 0.0, 1.0 * source.size[axis])));
        end[axis] = static_cast<int>(std::ceil(std::clamp(to[axis], 0.0, 1.0 * source.size[axis])));
    }
    for (int y = begin.y; y < end.y; ++y) {
        for (int x = begin.x; x < end.x; ++x) {
            std::array<V2d, 4> quad = box_corners(V2d(x, y), V2d(x + 1, y + 1));
            bool seen = true;
            for (V2d& p : quad) {
                seen = seen && to_target.reaches(p);
                if (seen) p = to_target(p);
            }
            const double share = seen ? area_within(quad, low, high) : 0;
            if (!(share > kLeast)) continue;
            shares_.push_back({static_cast<std::uint32_t>(source.index(x, y)), static_cast<float>(share)});
            used_[source.index(x, y)] = true;
        }
    }
}

// Sums over source cells, each weighted by weight_of(the area that it shares).
template <typename WeightOf>
void AreaMap::sums(std::span<const float> source, std::span<float> target, WeightOf&& weight_of) const {
    for (std::size_t i = 0; i < target.size(); ++i) {
        double sum = 0;
        for (std::size_t s = first_[i]; s < first_[i + 1]; ++s)
            sum += weight_of(double{shares_[s].area}) * double{source[shares_[s].cell]};
        target[i] = static_cast<float>(sum);
    }
}

void AreaMap::means(std::span<const float> source, std::span<float> target) const {
    sums(source, target, [](double area) { return area; });
}

void AreaMap::variances(std::span<const float> source, std::span<float> target) const {
    sums(source, target, [](double area) { return area * area; });
}

double AreaMap::covered(std::size_t target) const {
    double sum = 0;
    for (std::size_t s = first_[target]; s < first_[target + 1]; ++s) sum += double{shares_[s].area};
    return sum;
}

AreaMap AreaMap::of_covered() && {
    for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
        const double whole = covered(i);
        for (std::size_t s = first_[i]; s < first_[i + 1]; ++s)  // shares are > 0, so `whole` is, too
            shares_[s].area = static_cast<float>(double{shares_[s].area} / whole);
    }
    return std::move(*this);
}

AreaMap photograph_to_plane(const V2i& photograph, const V2i& plane, const Corners& corners) {
    for (const V2d& c : corners) {
        constexpr double kRounding = 1e-6;  // pixels
        const bool inside = c.x >= -kRounding && c.y >= -kRounding && c.x <= photograph.x + kRounding &&
                            c.y <= photograph.y + kRounding;
        if (inside) continue;
        throw InputError(
            fmt::format("a corner of M at ({:g}, {:g}) lies outside the photographs of {} x {} pixels", c.x,
                        c.y, photograph.x, photograph.y));
    }
    return AreaMap({plane, true}, {photograph, false}, Homography::of_rectangle(V2d(plane), corners))
        .of_covered();
}

AreaMap plane_to_photograph(const V2i& plane, const V2i& photograph, const Corners& corners) {
    return AreaMap({photograph, false}, {plane, true},
                   Homography::of_rectangle(V2d(plane), corners).inverse())
        .of_covered();
}

}  // namespace lucerna
