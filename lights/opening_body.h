// A luminous opening as a body in space: where lines enter it, and points of it.
//
// Everything is in the lamp's frame around the middle of the body, in scene units. An affine map makes every
// body a unit cube, cylinder or sphere. It maps the direction w to v = (YZ w_x, XZ w_y, XY w_z), up to a
// factor, and projected areas along w to |v| times those of the unit body along v. So a flat body, whose map
// has no inverse, is no special case.
//
// The sides of a box or of an upright cylinder may shine over less than its height (EULUMDAT states a height
// for each side). The body then has the largest of the heights, and the side that faces w is dark beyond its
// own, which is measured from the lower end (nadir is +z). A line leaves a convex body once, so the area of
// the shining part along w is the opening's projected_area(w) exactly.
#pragma once

#include <array>
#include <optional>

#include "engine/base/vec.h"
#include "lights/luminous_opening.h"

namespace lucerna {

class OpeningBody {
  public:
    // A point of the body's surface with the outward unit normal.
    struct Place {
        V3d p, n;
    };
    struct Entry : Place {
        double t;  // > 0, along the line
    };

    // The opening has an area. `metre` is the length of a metre in scene units.
    OpeningBody(const LuminousOpening& opening, double metre);

    const V3d& half() const { return half_; }  // half of the sizes
    bool is_box() const { return kind_ == Kind::box; }

    // Returns where the line from o along d (unit) enters the body ahead of o. Returns none if it misses the
    // body or if o lies inside, because light begins where a line leaves the body.
    std::optional<Entry> entry(const V3d& o, const V3d& d) const;

    // Returns the area of the whole body, and of its shining part, projected along w (unit).
    double whole_area(const V3d& w) const;
    double shining_area(const V3d& w) const { return opening_.projected_area(w) * metre_ * metre_; }
    // Tells whether the surface shines along w where lines along w leave it.
    bool shines(const Place& from, const V3d& w) const;

    // Draws a point that faces w, uniformly over the projection of the whole body, or of its shining part,
    // along w. Returns none if this area is 0.
    std::optional<Place> draw_whole(const V3d& w, const V2f& u) const { return draw(w, {1, 1}, u); }
    std::optional<Place> draw_shining(const V3d& w, const V2f& u) const { return draw(w, shares(w), u); }

  private:
    enum class Kind : std::uint8_t { box, cylinder, ellipsoid };
    // The shining shares of the heights of the sides along x and y; those of a cylinder are the same number.
    using Shares = std::array<double, 2>;

    static double tallest(const LuminousOpening& opening);
    Shares shares(const V3d& w) const;
    V3d map(const V3d& w) const;
    std::optional<Place> draw(const V3d& w, const Shares& shares, const V2f& u) const;
    Place on_box(const V3d& areas, const V3d& v, const Shares& shares, const V2f& u) const;
    Place on_cylinder(double cap, double side, const V3d& v, double share, const V2f& u) const;
    Place on_ellipsoid(const V3d& v, const V2f& u) const;
    Place placed(const V3d& unit_p, const V3d& unit_n) const;

    LuminousOpening opening_;
    double metre_;
    V3d half_;
    double tallest_;  // metres
    Kind kind_;
    int axis_ = 2;  // of a cylinder
};

}  // namespace lucerna
