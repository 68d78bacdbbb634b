#include "photon/resting_point.h"

#include <cmath>

namespace lucerna {
namespace {

constexpr int kMostSurfaces = 8;  // on the way: sheets that lie close to each other

// Of the surface that p lies on within that surface's own error, met from `height` over p.
std::optional<float> error_met_from(const Scene& scene, const V3f& p, const V3f& n, float height) {
    Ray down{p + height * n, -n, 2 * height};
    for (int i = 0; i < kMostSurfaces && down.t_max > 0; ++i) {
        const auto hit = scene.intersect(down);
        if (!hit) return std::nullopt;
        // Twice: p is off by one error, the hit by another.
        if (std::fabs((hit->at.p - p).dot(n)) <= 2 * hit->at.error) return hit->at.error;
        down = Ray{hit->at.towards(-n), -n, down.t_max - hit->t};
    }
    return std::nullopt;
}

}  // namespace

SurfacePoint resting_point(const Scene& scene, const V3f& p, const V3f& n) {
    // Twice what rounding comes to on whatever the scene can hold; and what a thick curve's own bound may be.
    const float rounding = 2 * surface_error(p, diagonal(scene));
    for (const float height : {rounding, 1e3F * rounding}) {
        if (const auto error = error_met_from(scene, p, n, height)) return {p, n, *error};
    }
    return {p, n, surface_error(p, 0)};
}

}  // namespace lucerna
