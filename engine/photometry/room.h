// The room around a task area: its clear height and its walls, found by rays.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "engine/scene/calculation_surface.h"
#include "engine/scene/scene.h"

namespace lucerna {

// A plane part of the room's sides, from the floor to the ceiling. World, scene units.
struct Wall {
    V3d from, to;  // ends of the lower edge; up x inward points from the first to the second
    V3d inward;    // unit, horizontal
    double width() const { return (to - from).length(); }
};

class Room {
  public:
    // Looks around from points within the room, for a scene in metres with upward axis `up_axis` (0 to 2).
    // The ceiling is at the most frequent height of what is above the places around the points, and the floor
    // is the lowest height that a tenth of what is below them has. Returns none if there is no ceiling, no
    // floor at least 2 m below it, or no wall.
    //
    // Horizontal rays a little below the ceiling, above furniture, doors and windows, find the sides of the
    // room, also around corners: the rays start again from wherever they arrived. Upright surfaces are walls
    // if they continue downwards, as luminaires on the ceiling do not, and if they are at least 0.5 m wide.
    // Recesses of up to 0.6 m, such as windows, belong to the wall around them. An open side has no wall:
    // there the room ends with its ceiling, and what stands beyond is outside.
    static std::optional<Room> around(const Scene& scene, std::span<const V3d> points, int up_axis);

    int up_axis() const { return up_axis_; }
    double floor() const { return floor_; }      // heights along the upward axis, world
    double ceiling() const { return ceiling_; }  // > floor() + 2
    const std::vector<Wall>& walls() const { return walls_; }
    // Bounds in plan, from the floor to the ceiling; world.
    const Imath::Box<V3d>& bounds() const { return bounds_; }
    // Tells whether a side is open: the walls form no closed outlines.
    bool is_open_sided() const;
    // Returns the area in plan: exactly that within the walls if they form closed outlines, else to a
    // hundredth of the bounds' area.
    double area(const Scene& scene) const;
    // Returns the reflectance (luminance of the albedo) of the floor, the walls and the ceiling: the median
    // over what light meets that comes straight at them from close by.
    struct Reflectances {
        double floor = 0, walls = 0, ceiling = 0;
    };
    Reflectances reflectances(const Scene& scene) const;
    // Returns whether nothing is between the point and a place above it just below the ceiling, as over or
    // inside furniture.
    bool is_open(const Scene& scene, const V3d& point) const;
    // Returns whether the room holds the point (world), in plan.
    bool holds(const Scene& scene, const V3d& point) const;

  private:
    int up_axis_ = 1;
    double floor_ = 0, ceiling_ = 0, sight_ = 0;  // sight_: height of the horizontal rays
    std::vector<Wall> walls_;
    std::vector<V3d> seen_from_;
    Imath::Box<V3d> bounds_;
};

}  // namespace lucerna
