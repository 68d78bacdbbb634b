#include "lights/opening_body.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/warp.h"

namespace lucerna {
namespace {

// The part of a line that lies in all of several convex bodies.
struct Within {
    double enter = -INFINITY, leave = INFINITY;
    V3d n{0, 0, 0};  // outward, where the line enters

    void meet(double from, double to, const V3d& normal) {
        if (from > enter) enter = from, n = normal;
        leave = std::min(leave, to);
    }
    void miss() { leave = -INFINITY; }
};

void meet_slab(Within& line, int axis, double half, const V3d& o, const V3d& d) {
    if (d[axis] == 0) {
        if (std::fabs(o[axis]) > half) line.miss();
        return;
    }
    const double far = std::copysign(half, d[axis]);
    V3d n(0, 0, 0);
    n[axis] = -std::copysign(1.0, d[axis]);
    line.meet((-far - o[axis]) / d[axis], (far - o[axis]) / d[axis], n);
}

// Meets the quadric |inverse p| <= 1; `inverse` is 0 along the axis of a cylinder.
void meet_quadric(Within& line, const V3d& inverse, const V3d& o, const V3d& d) {
    const V3d q = o * inverse, e = d * inverse;
    const double e2 = e.length2();
    if (e2 == 0) {
        if (q.length2() > 1) line.miss();
        return;
    }
    const double discriminant = e2 - q.cross(e).length2();
    if (discriminant < 0) return line.miss();
    const double root = std::sqrt(discriminant), enter = (-q.dot(e) - root) / e2;
    line.meet(enter, (-q.dot(e) + root) / e2, ((q + enter * e) * inverse).normalized());
}

// Makes u uniform again after a choice with probability `width` that began at `from`.
double remainder(double u, double from, double width) {
    return std::clamp((u - from) / width, 0.0, kBelowOneD);
}

}  // namespace

OpeningBody::OpeningBody(const LuminousOpening& opening, double metre)
    : opening_(opening), metre_(metre), tallest_(tallest(opening)), kind_(Kind::box) {
    using Shape = LuminousOpening::Shape;
    half_ = 0.5 * metre * V3d(opening.size.x, opening.size.y, tallest_);
    if (opening.shape == Shape::ellipsoid) kind_ = Kind::ellipsoid;
    if (opening.shape == Shape::cylinder_along_c0) kind_ = Kind::cylinder, axis_ = 0;
    if (opening.shape == Shape::cylinder_along_c90) kind_ = Kind::cylinder, axis_ = 1;
    if (opening.shape == Shape::cylinder_upright) kind_ = Kind::cylinder;
    for (int axis = 0; axis < 3; ++axis) {
        if (half_[axis] > 0) continue;
        // A flat ellipsoid is an ellipse, and a cylinder that is flat across is a rectangle.
        if (kind_ == Kind::ellipsoid) kind_ = Kind::cylinder, axis_ = axis;
        if (axis != axis_) kind_ = Kind::box;
    }
}

double OpeningBody::tallest(const LuminousOpening& opening) {
    return *std::max_element(opening.side_heights.begin(), opening.side_heights.end());
}

std::optional<OpeningBody::Entry> OpeningBody::entry(const V3d& o, const V3d& d) const {
    // Begins at the point of the line nearest to the middle, so that no digits are lost far away.
    const double nearest = -o.dot(d);
    const V3d from = o + nearest * d;
    if (from.length2() > half_.length2()) return std::nullopt;
    Within line;
    V3d inverse(0, 0, 0);
    for (int axis = 0; axis < 3; ++axis) {
        const bool flat_side = kind_ == Kind::box || (kind_ == Kind::cylinder && axis == axis_);
        if (flat_side)
            meet_slab(line, axis, half_[axis], from, d);
        else
            inverse[axis] = 1 / half_[axis];  // > 0, see the constructor
    }
    if (kind_ != Kind::box) meet_quadric(line, inverse, from, d);
    const double t = nearest + line.enter;
    if (!(line.enter <= line.leave && t > 0)) return std::nullopt;
    return Entry{{from + line.enter * d, line.n}, t};
}

V3d OpeningBody::map(const V3d& w) const {
    const V3d size = 2.0 * half_;
    return {size.y * size.z * w.x, size.x * size.z * w.y, size.x * size.y * w.z};
}

double OpeningBody::whole_area(const V3d& w) const {
    const V3d v = map(w);
    if (kind_ == Kind::box) return std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.z);
    if (kind_ == Kind::ellipsoid) return kPiD / 4 * v.length();
    return kPiD / 4 * std::fabs(v[axis_]) + hypot(v[(axis_ + 1) % 3], v[(axis_ + 2) % 3]);
}

OpeningBody::Shares OpeningBody::shares(const V3d& w) const {
    if (!(tallest_ > 0)) return {1, 1};
    const auto [x, y] = opening_.heights_towards(w);
    return {x / tallest_, y / tallest_};
}

bool OpeningBody::shines(const Place& from, const V3d& w) const {
    if (kind_ == Kind::ellipsoid || from.n.z != 0) return true;
    const Shares share = shares(w);
    const double of_side = from.n.x != 0 ? share[0] : share[1];
    return of_side == 1 || half_.z - from.p.z <= 2 * half_.z * of_side;
}

std::optional<OpeningBody::Place> OpeningBody::draw(const V3d& w, const Shares& shares, const V2f& u) const {
    const V3d v = map(w);
    if (kind_ == Kind::box) {
        const V3d areas(shares[0] * std::fabs(v.x), shares[1] * std::fabs(v.y), std::fabs(v.z));
        if (!(areas.x + areas.y + areas.z > 0)) return std::nullopt;
        return on_box(areas, v, shares, u);
    }
    if (!(v.length2() > 0)) return std::nullopt;
    if (kind_ == Kind::ellipsoid) return on_ellipsoid(v, u);
    const double share = axis_ == 2 ? shares[0] : 1;
    const double cap = kPiD / 4 * std::fabs(v[axis_]);
    const double side = share * hypot(v[(axis_ + 1) % 3], v[(axis_ + 2) % 3]);
    if (!(cap + side > 0)) return std::nullopt;
    return on_cylinder(cap, side, v, share, u);
}

OpeningBody::Place OpeningBody::on_box(const V3d& areas, const V3d& v, const Shares& shares,
                                       const V2f& u) const {
    const double at = double{u.x} * (areas.x + areas.y + areas.z);
    int axis = 2;
    double before = areas.x + areas.y;
    if (at < areas.x)
        axis = 0, before = 0;
    else if (at < before)
        axis = 1, before = areas.x;
    V3d n(0, 0, 0), p(0, 0, 0);
    n[axis] = std::copysign(1.0, v[axis]);
    p[axis] = 0.5 * n[axis];
    p[(axis + 1) % 3] = remainder(at, before, areas[axis]) - 0.5;
    p[(axis + 2) % 3] = double{u.y} - 0.5;
    if (axis != 2) p.z = 0.5 - shares[static_cast<std::size_t>(axis)] * (0.5 - p.z);
    return placed(p, n);
}

OpeningBody::Place OpeningBody::on_cylinder(double cap, double side, const V3d& v, double share,
                                            const V2f& u) const {
    const int b = (axis_ + 1) % 3, c = (axis_ + 2) % 3;
    const double at = double{u.x} * (cap + side);
    V3d n(0, 0, 0), p(0, 0, 0);
    if (at < cap) {
        const V2f disc = square_to_disc({static_cast<float>(remainder(at, 0, cap)), u.y});
        n[axis_] = std::copysign(1.0, v[axis_]);
        p[axis_] = 0.5 * n[axis_];
        p[b] = 0.5 * double{disc.x}, p[c] = 0.5 * double{disc.y};
    } else {
        // The projection is uniform in the sine of the angle to v.
        const double length = hypot(v[b], v[c]), sine = 2 * remainder(at, cap, side) - 1;
        const double cosine = std::sqrt(std::max(0.0, 1 - sine * sine));
        n[b] = (cosine * v[b] - sine * v[c]) / length;
        n[c] = (cosine * v[c] + sine * v[b]) / length;
        p = 0.5 * n;
        p[axis_] = 0.5 - share * (1 - double{u.y});
    }
    return placed(p, n);
}

OpeningBody::Place OpeningBody::on_ellipsoid(const V3d& v, const V2f& u) const {
    const V3d axis = v.normalized();
    const Frame frame{V3f(axis)};
    const V2f disc = square_to_disc(u);
    const double x = double{disc.x}, y = double{disc.y};
    const V3d n = (x * V3d(frame.s) + y * V3d(frame.t) + std::sqrt(std::max(0.0, 1 - x * x - y * y)) * axis)
                      .normalized();
    return placed(0.5 * n, n);
}

// Maps a point of the unit body and its normal. Normals map like directions of projection.
OpeningBody::Place OpeningBody::placed(const V3d& unit_p, const V3d& unit_n) const {
    return {2.0 * half_ * unit_p, map(unit_n).normalized()};
}

}  // namespace lucerna
