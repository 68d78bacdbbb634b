// Where a path meets a surface or is scattered in a medium, as whoever lights such a place asks for it.
#pragma once

#include <cmath>
#include <cstdint>

#include "engine/scene/bsdf.h"
#include "engine/scene/passage.h"
#include "engine/scene/phase.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Where a path meets a surface that scatters.
struct Vertex {
    const Hit& hit;
    const Bsdf& bsdf;
    V3f wo;                           // towards the eye
    std::int32_t medium = kNoMedium;  // of the borders, in which it lies on wo's side

    SurfacePoint from() const { return hit.at; }
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

// True if nothing stands between two surface points; both ends are moved off their surfaces.
bool visible_between(const Scene& scene, const SurfacePoint& x, const SurfacePoint& y);

}  // namespace lucerna
