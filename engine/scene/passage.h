// Ways through a scene's media, from one vertex of a path to the next.
//
// Between two surfaces a way may cross interfaces at which the medium changes: it falls into pieces, each in
// one medium of the borders and any number of regions. Whoever goes along must say in which medium the way
// begins: what a path carries from border to border.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "engine/base/sampler.h"
#include "engine/scene/flight.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Borders on one way. Only rounding at a grazing border can exhaust them.
inline constexpr int kMaxBorders = 10'000;

struct MediumPiece {
    Ray ray;              // from the border before it; t_max is the piece's end
    double to_go;         // from ray.o to the end of the whole way
    std::int32_t medium;  // of the borders
    MediaAlong along;     // not empty
};

// Calls visit(MediumPiece) for the pieces of the ray up to t_max that hold any medium, until it returns
// false. Returns the medium at the end, or where it was stopped. Surfaces are not looked for.
template <typename Visit>
std::int32_t for_each_piece(const Scene& scene, const Ray& ray, std::int32_t medium, Visit&& visit) {
    Ray rest = ray;
    for (int borders = 0; borders < kMaxBorders; ++borders) {
        const auto hit = scene.has_borders() ? scene.intersect_border(rest) : std::nullopt;
        const double to_go = static_cast<double>(rest.t_max);
        const double end = hit ? static_cast<double>(hit->t) : to_go;
        MediaAlong along(scene.media(), medium, rest, end);
        if (!along.empty() && !visit(MediumPiece{rest, to_go, medium, std::move(along)})) return medium;
        if (!hit) return medium;
        medium = medium_towards(hit->media, hit->at.n, rest.d, medium);
        rest = Ray{hit->at.towards(rest.d), rest.d, rest.t_max - hit->t};
        if (!(rest.t_max > 0)) return medium;
    }
    return medium;
}

// The share that passes the media of the ray from 0 to t_max, begun in `medium`: unbiased, and exact where no
// medium varies. 1 without media.
Rgb passage(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler);

// The same over a way that leaves the point x towards w.
inline Rgb passage(const Scene& scene, const SurfacePoint& x, const V3f& w, float distance,
                   std::int32_t medium, Sampler& sampler) {
    if (scene.media().empty()) return Rgb(1);
    return passage(scene, Ray{x.towards(w), w, distance}, medium, sampler);
}

// Where a way is scattered at distance t of a piece whose whole way ends on the surface `hit`: never on the
// far side of it, whatever was rounded.
V3f scattering_point(const MediumPiece& piece, double t, const std::optional<Hit>& hit);

// What becomes of a particle on its way to the next surface.
struct Crossing {
    Rgb power;            // at the end, or after it was scattered; what media absorb is taken off
    std::int32_t medium;  // around it then
    struct Scattered {
        V3f p;
        float g;  // of the medium that scattered
    };
    std::optional<Scattered> scattered;
};

// `hit` is what the ray meets, if anything. `power` is not black.
Crossing cross_media(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit, std::int32_t medium,
                     const Rgb& power, Sampler& sampler);

// The medium of the borders around a point from which light leaves towards d. It is found by looking at
// borders from there; where none is to be seen, it is that around the camera.
std::int32_t medium_around(const Scene& scene, const SurfacePoint& from, const V3f& d);

}  // namespace lucerna
