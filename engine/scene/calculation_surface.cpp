#include "engine/scene/calculation_surface.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/error.h"

namespace lucerna {

V2i default_points(double u_length, double v_length) {
    const double longer = std::max(u_length, v_length), shorter = std::min(u_length, v_length);
    const double d = longer >= 2 * shorter ? shorter : longer;
    const double spacing = std::min(10.0, 0.2 * pow(5.0, log10(d)));
    const auto along = [spacing](double length) {
        return static_cast<int>(std::clamp(std::round(length / spacing), 1.0, 1e9));
    };
    return {along(u_length), along(v_length)};
}

V2i points_apart(double u_length, double v_length, double spacing) {
    // The tolerance keeps rounding from adding a cell where the length is a multiple of the spacing.
    const auto along = [spacing](double length) {
        return static_cast<int>(std::clamp(std::ceil(length / spacing - 1e-9), 1.0, 1e9));
    };
    return {along(u_length), along(v_length)};
}

void check_surface(const CalculationSurface& surface, const Location& at) {
    const double area = surface.u.cross(surface.v).length();
    if (!std::isfinite(area) || !(area > 1e-9 * surface.u.length() * surface.v.length())) {
        input_error(at,
                    "calculation surface \"{}\": its sides ({:g} {:g} {:g}) and ({:g} {:g} {:g}) span no "
                    "area; expected two sides that are not parallel",
                    surface.name, surface.u.x, surface.u.y, surface.u.z, surface.v.x, surface.v.y,
                    surface.v.z);
    }
    if (surface.points.x < 1 || surface.points.y < 1 || surface.size() > kMostSurfacePoints) {
        input_error(at, "calculation surface \"{}\": {} x {} points; expected 1 to {}", surface.name,
                    surface.points.x, surface.points.y, kMostSurfacePoints);
    }
    if (surface.kind == ReceiverKind::semicylindrical && std::fabs(surface.normal.dot(surface.up)) > 1e-3F) {
        input_error(at,
                    "calculation surface \"{}\": a semicylinder must face a direction perpendicular to its "
                    "axis; ({:g} {:g} {:g}) is not horizontal",
                    surface.name, surface.normal.x, surface.normal.y, surface.normal.z);
    }
}

}  // namespace lucerna
