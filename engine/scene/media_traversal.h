// Traverses a scene's media from one vertex of a path to the next.
//
// A ray between two surfaces may cross interfaces at which the medium changes. They divide it into pieces,
// each in one medium of the interfaces and any number of regions. The caller must know the medium in which
// the ray begins, which a path carries from interface to interface.
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

// fly() draws a distance for a path; transmittance() estimates the share that passes. Both are unbiased for
// any density: where it varies, null collisions fill it up to a bound. Absorption reduces the throughput and
// is never decided by Russian roulette. scatter_within() draws a place on a ray whose end is shaded anyway;
// in uniform media it never draws beyond the end.
//
// Sources: delta tracking [Woodcock 1965]; ratio tracking [Novák 2014]; the weights by which one distance
// serves three channels [Miller 2019]. The channel that draws it is chosen in proportion to the throughput,
// and the estimate is divided by the mean over all channels' densities, so that no channel gains more than
// the sum of all.

struct Flight {
    bool scattered = false;  // within the media; else the end was reached
    double t = 0;            // place of the event along the ray, scene units
    float g = 0;             // of the medium that scattered
    Rgb throughput{0.0F};    // after scattering, or at the end; black if absorbed
    Rgb emitted{0.0F};       // by the media on the way, throughput included, W/(m² sr)
};

// `throughput` must not be black. Draws one pair of numbers from `sampler` and the rest from a branch of it.
Flight fly(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// Holds a place at which a medium scatters light back towards the beginning of a ray.
struct InScattering {
    double t = 0;       // along the ray, scene units
    float g = 0;        // of the medium that scatters there
    Rgb flow{0.0F};     // transmittance to the beginning, divided by the density of t; scene units
    Rgb sigma_s{0.0F};  // of all media there, per scene unit
};

// Draws a place so that, for any function F of place and phase function, the mean of flow·F (0 without a
// place) is the integral of transmittance · F over the ray, where media scatter. `throughput`, not black, is
// that of the path and only serves importance sampling. Draws one pair of numbers from `sampler` and the rest
// from a branch of it.
std::optional<InScattering> scatter_within(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// Does this for a t within `along` that the caller draws and by whose density it divides: `flow` is the
// transmittance from t to the beginning. `before` is the ray up to t. Returns none if nothing scatters there.
std::optional<InScattering> scattered_at(MediaAlong along, MediaAlong before, double t, const Rgb& throughput,
                                         Sampler& sampler);

// Estimates the transmittance from end to end, without bias; 0 over an infinite ray through a medium. It is
// exact, without random numbers, if no medium varies.
Rgb transmittance(MediaAlong along, Sampler& sampler);

// Limits the medium interfaces on one ray. Only rounding at a grazing interface can reach it.
inline constexpr int kMaxMediumInterfaces = 10'000;

struct MediumPiece {
    Ray ray;              // begins at the interface before the piece; t_max is the piece's end
    double to_go;         // from ray.o to the end of the whole ray
    std::int32_t medium;  // medium of the interfaces
    MediaAlong along;     // not empty
};

// Calls visit(MediumPiece) for each piece of the ray up to t_max that contains any medium, until it returns
// false. Returns the medium at the end, or where visit() stopped. Ignores surfaces that are not interfaces.
template <typename Visit>
std::int32_t for_each_piece(const Scene& scene, const Ray& ray, std::int32_t medium, Visit&& visit) {
    Ray rest = ray;
    for (int interfaces = 0; interfaces < kMaxMediumInterfaces; ++interfaces) {
        const auto hit =
            scene.has_medium_interfaces() ? scene.intersect_medium_interface(rest) : std::nullopt;
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

// Estimates the transmittance of the media along the ray from 0 to t_max, which begins in `medium`. It is
// unbiased, exact if no medium varies, and 1 without media.
Rgb transmittance(const Scene& scene, const Ray& ray, std::int32_t medium, Sampler& sampler);

// Estimates the share of light that passes a whole ray (way_from(), way_between()) in a straight line: 0 if
// anything opaque is met. Panes and other surfaces that pass light unbent attenuate it by its direction
// (Bsdf::straight_share()), and so do media: unbiased, and exact if no medium varies. The ray begins in
// `medium`. With `shadow`, cut-outs count as for shadow rays, otherwise as for rays from the eye.
Rgb passing(const Scene& scene, const Ray& way, std::int32_t medium, Sampler& sampler, bool shadow = true);

// Returns the place at distance t of a piece whose whole ray ends on the surface `hit`. Despite rounding, it
// is never on the far side of the surface.
V3f scattering_point(const MediumPiece& piece, double t, const std::optional<Hit>& hit);

// Holds the outcome of a particle's flight to the next surface.
struct MediaTraversal {
    Rgb power;            // at the end or after scattering, less absorption
    std::int32_t medium;  // around the particle after the flight
    struct Scattered {
        V3f p;
        float g;  // of the medium that scattered
    };
    std::optional<Scattered> scattered;
};

// `hit` is the hit of the ray, if any. `power` must not be black.
MediaTraversal traverse_media(const Scene& scene, const Ray& ray, const std::optional<Hit>& hit,
                              std::int32_t medium, const Rgb& power, Sampler& sampler);

// Returns the medium of the interfaces at a point where light leaves or arrives, on d's side of its surface.
// It looks along d and towards an interface of the scene; if it finds none, the medium is that around the
// camera.
std::int32_t medium_around(const Scene& scene, const SurfacePoint& from, const V3f& d);

// Direct light is computed for a Vertex or a MediumVertex.

// Holds a place where a path meets a surface that scatters.
struct Vertex {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f wo;                           // towards the eye
    std::int32_t medium = kNoMedium;  // medium of the interfaces, on wo's side

    SurfacePoint from() const { return hit.at; }
    V3f normal() const { return face_forward(hit.at.n, wo); }  // geometric, on wo's side
    // Returns the share of the radiance per solid angle from w that leaves towards wo: f·cosθ.
    Rgb value(const V3f& w) const {
        return bsdf.f(wo, w, Transport::radiance) * std::fabs(w.dot(bsdf.shading_normal()));
    }
    float pdf_w(const V3f& w) const { return bsdf.pdf_w(wo, w); }
    std::int32_t medium_towards(const V3f& w) const {
        return lucerna::medium_towards(hit.media, hit.at.n, w, medium);
    }
};

// Holds a place where a path is scattered in a medium.
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
