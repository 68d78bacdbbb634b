// A calculation surface: a parallelogram with a grid of points at which illuminance is worked out. It is no
// surface of the scene; light passes through it.
#pragma once

#include <string>

#include "engine/base/error.h"
#include "engine/scene/receiver.h"

namespace lucerna {

struct CalculationSurface {
    std::string name;
    V3d corner;  // world, scene units
    V3d u, v;    // its sides, from the corner; not parallel, neither zero
    V3f normal;  // unit: the side that is lit; a cylinder's axis, the direction that a semicylinder faces
    V3f up;      // unit: a semicylinder's axis
    V2i points;  // along u and v, each >= 1
    ReceiverKind kind = ReceiverKind::planar;

    std::size_t size() const {
        return static_cast<std::size_t>(points.x) * static_cast<std::size_t>(points.y);
    }
    // In the middle of its cell of the grid. v grows with y.
    V3d position(int x, int y) const { return corner + (x + 0.5) / points.x * u + (y + 0.5) / points.y * v; }
    Receiver receiver(int x, int y) const { return {position(x, y), normal, up, kind}; }
};

// Points along the sides, in metres, as EN 12464-1 (section 4.4) has them: cells of p = 0.2 m 5^log10(d), d
// the longer side, or the shorter one where the longer is twice as long or more; at most 10 m; to the nearest
// whole number of cells.
V2i default_points(double u_length, double v_length);
// The fewest points that are at most so far apart.
V2i points_apart(double u_length, double v_length, double spacing);

// Throws InputError, placed at `at`, that names what of the surface is not accepted: sides that are no
// parallelogram, a semicylinder without a direction across its axis, more than kMostSurfacePoints points.
void check_surface(const CalculationSurface& surface, const Location& at);
inline constexpr std::size_t kMostSurfacePoints = 1 << 22;

}  // namespace lucerna
