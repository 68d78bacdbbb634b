// A calculation surface is a parallelogram with a grid of points at which illuminance is calculated. It is
// not part of the scene's geometry; light passes through it.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/scene/receiver.h"

namespace lucerna {

struct CalculationSurface {
    std::string name;
    V3d corner;  // world, scene units
    V3d u, v;    // its sides, from the corner; not parallel, neither zero
    V3f normal;  // unit: the lit side; a cylinder's axis; the direction that a semicylinder faces
    V3f up;      // unit: a semicylinder's axis
    V2i points;  // along u and v, each >= 1
    ReceiverKind kind = ReceiverKind::planar;
    // Points that do not count in the surface's mean and extremes, (x, y) at y * points.x + x; empty: all do.
    std::vector<bool> excluded = {};

    std::size_t size() const {
        return static_cast<std::size_t>(points.x) * static_cast<std::size_t>(points.y);
    }
    std::size_t index(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(points.x) + static_cast<std::size_t>(x);
    }
    bool counts(int x, int y) const { return excluded.empty() || !excluded[index(x, y)]; }
    // Tells whether the surface is level within 2.5 degrees, for an upward axis of 0 to 2.
    bool is_level(int up_axis) const { return std::fabs(u.cross(v).normalized()[up_axis]) > 0.999; }
    // Returns the centre of a grid cell. v grows with y.
    V3d position(int x, int y) const { return corner + (x + 0.5) / points.x * u + (y + 0.5) / points.y * v; }
    Receiver receiver(int x, int y) const { return {position(x, y), normal, up, kind}; }
};

// Returns the numbers of points along the sides, which are in metres, by EN 12464-1 (section 4.4). The cell
// size is p = 0.2 m 5^log10(d), at most 10 m. d is the longer side, or the shorter one if the longer is at
// least twice as long. The number of cells is rounded to the nearest integer.
V2i default_points(double u_length, double v_length);
// Returns the smallest numbers of points whose spacing is at most `spacing`.
V2i points_apart(double u_length, double v_length, double spacing);

// Throws InputError, located at `at`, if the sides span no parallelogram, if a semicylinder does not face
// across its axis, or if there are more than kMostSurfacePoints points.
void check_surface(const CalculationSurface& surface, const Location& at);
inline constexpr std::size_t kMostSurfacePoints = 1 << 22;

}  // namespace lucerna
