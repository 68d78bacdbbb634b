#include "engine/world/medium.h"

#include <algorithm>

namespace lucerna {
namespace {

struct Span {
    double entry, exit;
};

// The slabs of a box, one axis after the other.
std::optional<Span> clip(const Box3d& box, const V3d& o, const V3d& d, Span span) {
    for (int k = 0; k < 3; ++k) {
        if (d[k] == 0) {
            if (o[k] < box.min[k] || o[k] > box.max[k]) return std::nullopt;
            continue;
        }
        const double a = (box.min[k] - o[k]) / d[k];
        const double b = (box.max[k] - o[k]) / d[k];
        span.entry = std::max(span.entry, std::min(a, b));
        span.exit = std::min(span.exit, std::max(a, b));
    }
    if (!(span.entry < span.exit)) return std::nullopt;
    return span;
}

}  // namespace

std::optional<MediumCrossing> crossing(const Medium& medium, const Ray& ray, double end) {
    Span span{0, end};
    if (!(span.entry < span.exit)) return std::nullopt;
    if (medium.is_uniform() && !medium.box) {
        return MediumCrossing{&medium, 0, end, {medium.density, V3d(ray.o), V3d(ray.d), 0, end}};
    }
    V3d o, d;
    medium.medium_from_scene.multVecMatrix(V3d(ray.o), o);
    medium.medium_from_scene.multDirMatrix(V3d(ray.d), d);
    if (medium.box) {
        const auto clipped = clip(*medium.box, o, d, span);
        if (!clipped) return std::nullopt;
        span = *clipped;
    }
    return MediumCrossing{&medium, span.entry, span.exit, {medium.density, o, d, span.entry, span.exit}};
}

}  // namespace lucerna
