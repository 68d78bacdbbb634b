#include "engine/photometry/observer.h"

#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr double kDegree = kPiD / 180;

}  // namespace

double position_index(double from_vertical, double from_view) {
    const double t = from_vertical, s = from_view;
    // Directions below the line of sight follow [Iwata and Tokura 1997].
    if (t > 90) {
        const double offset = tan(s * kDegree);  // lateral over axial distance
        return offset < 0.6 ? 1 + 0.8 * offset : 1 + 1.2 * offset;
    }
    return exp((35.2 - 0.31889 * t - 1.22 * exp(-2 * t / 9)) * 1e-3 * s +
               (21 + 0.26667 * t - 0.002963 * t * t) * 1e-5 * s * s);
}

double position_index(const Observer& observer, const V3f& w) {
    const V3d view(observer.view), d(w);
    const double along = view.dot(d);
    if (!(along > 0)) return INFINITY;
    const V3d side = view.cross(V3d(observer.up)).normalized(), up = side.cross(view);
    const double s = atan2(view.cross(d).length(), along) / kDegree;
    const double t = atan2(std::fabs(side.dot(d)), up.dot(d)) / kDegree;
    return position_index(t, s);
}

}  // namespace lucerna
