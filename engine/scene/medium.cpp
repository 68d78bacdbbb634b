#include "engine/scene/medium.h"

#include <algorithm>

#include "engine/base/vec.h"

namespace lucerna {
namespace {

struct Span {
    double entry, exit;
};

// Clips the span to a box, one pair of planes after the other.
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

Rgb scattering_of(const Medium& medium, const V3f& p) {
    if (is_black(medium.sigma_s) || (medium.is_uniform() && !medium.box)) return medium.sigma_s;
    V3d q;
    medium.medium_from_scene.multVecMatrix(V3d(p), q);
    if (medium.box && !medium.box->intersects(q)) return Rgb(0);
    return medium.sigma_s * static_cast<float>(density_at(medium.density, q));
}

}  // namespace

Rgb scattering_at(const SceneMedia& media, std::int32_t inside, const V3f& p) {
    Rgb sum(0);
    if (inside != kNoMedium) sum += scattering_of(media.all[static_cast<std::size_t>(inside)], p);
    for (const std::uint32_t region : media.regions) sum += scattering_of(media.all[region], p);
    return sum;
}

bool scatters(const SceneMedia& media) {
    return std::ranges::any_of(media.all, [](const Medium& medium) { return !is_black(medium.sigma_s); });
}

const Medium* emitting_medium(const SceneMedia& media) {
    const auto found = std::ranges::find_if(media.all, &Medium::emits);
    return found == media.all.end() ? nullptr : &*found;
}

Box3d bounds_of(const SceneMedia& media) {
    Box3d box;
    for (const Medium& medium : media.all) {
        if (!medium.box) continue;
        box.extendBy(carried_box(*medium.box, medium.medium_from_scene.inverse()));
    }
    return box;
}

Rgb passes_without_end(const SceneMedia& media, std::int32_t inside) {
    Rgb result(1);
    const auto weaken = [&](const Medium& medium) {
        if (medium.box || !medium.is_uniform()) return;
        for (int k = 0; k < 3; ++k) {
            if (medium.sigma_t()[k] > 0) result[k] = 0;
        }
    };
    if (inside != kNoMedium) weaken(media.all[static_cast<std::size_t>(inside)]);
    for (const std::uint32_t region : media.regions) weaken(media.all[region]);
    return result;
}

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
