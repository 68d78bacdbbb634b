// Ways through a scene's media, from one vertex of a path to the next.
//
// Between two surfaces a way may cross interfaces at which the medium changes: it falls into pieces, each in
// one medium of the borders and any number of regions. Whoever goes along must say in which medium the way
// begins: what a path carries from border to border.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/media_along.h"
#include "engine/scene/medium.h"
#include "engine/scene/scene.h"

namespace lucerna {

// A flight through media: how far light comes, and what it loses and gains on the way.
//
// fly() draws a distance for a path; transmittance() estimates the share that passes. Both are unbiased for
// any density: where it varies, null collisions fill it up to a bound. What media absorb is taken off the
// throughput, never decided by chance. scatter_within() draws a place on a way of which the end is of
// interest anyway: where the media do not vary, none of its draws is lost beyond the end.
//
// Sources: delta tracking [Woodcock 1965]; ratio tracking [Novák 2014]; [Miller 2019]: the weights that make
// one distance serve three channels. The channel that draws it is chosen in proportion to the throughput, and
// the estimate is divided by the mean over all channels' densities, so no colour gains more than the sum of
// all.

struct Flight {
    bool scattered = false;  // within the media; otherwise the end was reached
    double t = 0;            // where, along the ray; scene units
    float g = 0;             // of the medium that scattered
    Rgb throughput{0.0F};    // after scattering (black: absorbed), or at the end
    Rgb emitted{0.0F};       // by the media on the way, throughput included, W/(m² sr)
};

// `throughput` is not black. Takes one pair of numbers from `sampler`, the rest from a branch of it.
Flight fly(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// A place at which light is scattered into the way, back towards its beginning.
struct InScattering {
    double t = 0;       // along the ray; scene units
    float g = 0;        // of the medium that scatters there
    Rgb flow{0.0F};     // the share that reaches the beginning, over the density of t, scene units
    Rgb sigma_s{0.0F};  // of all media there, per scene unit
};

// For any function F of place and phase function, the mean of flow·F (0 without a place) is the integral over
// the way of transmittance · F, where media scatter at all. `throughput`, not black, is what the light is
// worth to the path, and only serves to choose well. Takes one pair of numbers from `sampler`, the rest from
// a branch of it.
std::optional<InScattering> scatter_within(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// The same at a place that the caller has drawn, whose density it divides by: `flow` is the share that
// reaches the beginning from t, which lies within `along`; `before` is the way up to there. None: nothing
// scatters.
std::optional<InScattering> scattered_at(MediaAlong along, MediaAlong before, double t, const Rgb& throughput,
                                         Sampler& sampler);

// Its mean is the transmittance from end to end: 0 over an infinite way through a medium. Exact, and without
// random numbers, where nothing varies.
Rgb transmittance(MediaAlong along, Sampler& sampler);

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
        const Ray piece{rest.o, rest.d, static_cast<float>(end)};
        if (!along.empty() && !visit(MediumPiece{piece, to_go, medium, std::move(along)})) return medium;
        if (!hit) return medium;
        medium = medium_towards(hit->media, hit->at.n, rest.d, medium);
        rest = Ray{hit->at.towards(rest.d), rest.d, rest.t_max - hit->t};
        if (!(rest.t_max > 0)) return medium;
    }
    return medium;
}

// The share that passes the media of the ray from 0 to t_max, begun in `medium`: unbiased, and exact where no
// medium varies. 1 without media.
Rgb transmittance(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler);

// The share of light that passes a whole way (way_from(), way_between()) in a straight line: 0 if anything
// opaque is met. Panes and other surfaces that pass light unbent take their share of it, by its direction
// (Bsdf::straight_share()), and media theirs: unbiased, and exact where no medium varies. The way begins in
// `medium`. A shadow ray meets cut-outs as shadows do; others as rays from the eye do.
Rgb passing(const Scene& scene, const Ray& way, std::int32_t medium, Sampler& sampler, bool shadow = true);

// Where a way is scattered at distance t of a piece whose whole way ends on the surface `hit`: never on the
// far side of it, whatever was rounded.
V3f scattering_point(const MediumPiece& piece, double t, const std::optional<Hit>& hit);

// What becomes of a particle on its way to the next surface.
struct MediaTraversal {
    Rgb power;            // at the end, or after it was scattered; what media absorb is taken off
    std::int32_t medium;  // around it then
    struct Scattered {
        V3f p;
        float g;  // of the medium that scattered
    };
    std::optional<Scattered> scattered;
};

// `hit` is what the ray meets, if anything. `power` is not black.
MediaTraversal traverse_media(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                              std::int32_t medium, const Rgb& power, Sampler& sampler);

// The medium of the borders around a point from which light leaves, or to which it comes, on d's side of its
// surface. It is found by looking along d and towards a border of the scene; where there is none, the medium
// is that around the camera.
std::int32_t medium_around(const Scene& scene, const SurfacePoint& from, const V3f& d);

// Where a path meets a surface or is scattered in a medium, as whoever lights such a place asks for it.

// Where a path meets a surface that scatters.
struct Vertex {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f wo;                           // towards the eye
    std::int32_t medium = kNoMedium;  // of the borders, in which it lies on wo's side

    SurfacePoint from() const { return hit.at; }
    V3f normal() const { return face_forward(hit.at.n, wo); }  // geometric, on wo's side
    // Of what arrives from w per solid angle, the share that leaves towards wo: f·cosθ.
    Rgb value(const V3f& w) const {
        return bsdf.f(wo, w, Transport::radiance) * std::fabs(w.dot(bsdf.shading_normal()));
    }
    float pdf_w(const V3f& w) const { return bsdf.pdf_w(wo, w); }
    std::int32_t medium_towards(const V3f& w) const {
        return lucerna::medium_towards(hit.media, hit.at.n, w, medium);
    }
};

// Where a path is scattered in a medium.
struct MediumVertex {
    V3f p;
    HenyeyGreenstein phase;
    V3f wo;  // towards the eye
    std::int32_t medium;

    SurfacePoint from() const { return {p}; }
    Rgb value(const V3f& w) const { return Rgb(phase.value(wo, w)); }
    float pdf_w(const V3f& w) const { return phase.value(wo, w); }
    std::int32_t medium_towards(const V3f& /*w*/) const { return medium; }
};

}  // namespace lucerna
