// What one VPL sends to a place, and from there on towards the eye [Pharr 2004].
#pragma once

#include <algorithm>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl.h"

namespace lucerna {

// Clamping of the geometry term of near VPLs [Pharr 2004; Kollig and Keller 2004].
//
// A VPL sends cosθ_x cosθ_y / d² to a place x: without bound as d goes to 0, which one sees as a bright spot
// around it. So of each pair (x, y) a share, clamped(), is taken, and the rest is cut off: by a fade over
// distance [Pharr 2004], by a clamp of the factor [Kollig and Keller 2004], or by both. It depends on the
// pair alone: a ray from x that meets y can put back exactly what was cut, residual() = 1 - clamped().

inline float smoothstep(float low, float high, float x) {
    if (x <= low) return 0;
    if (x >= high) return 1;  // also when low == high: the divisor below is never 0
    const float t = (x - low) / (high - low);
    return t * t * (3 - 2 * t);
}

// The cosine with which a place receives: 1 in a medium.
inline float cosine_at(const Vertex& x, const V3f& w) {
    return std::fabs(w.dot(x.bsdf.shading_normal()));
}
inline float cosine_at(const MediumVertex& /*x*/, const V3f& /*w*/) {
    return 1;
}

class ClampedGeometry {
  public:
    // `mindist` in scene units, 0: no fade. `glimit` in 1/(scene unit)², 0: no clamp.
    ClampedGeometry(float mindist, float glimit) : min2_(sqr(mindist)), glimit_(glimit) {}

    // Of what a VPL at y would send to x, in [0,1]. `cosines`: |cosθ_x| |cosθ_y|, in a medium 1 each.
    // `error`: how far the two may lie off what they stand for; nearer than that, G has no value.
    float clamped(float d2, float cosines, float error) const {
        if (!(d2 > sqr(error))) return 0;
        const float faded = smoothstep(0.8F * min2_, 1.2F * min2_, d2);
        const float most = glimit_ * d2;  // of the cosines
        if (!(glimit_ > 0) || cosines <= most) return faded;
        return faded * most / cosines;  // cosines > most >= 0
    }
    // What clamping cuts off, which a compensating ray puts back.
    float residual(float d2, float cosines, float error) const { return 1 - clamped(d2, cosines, error); }

  private:
    float min2_, glimit_;
};

class VplShading {
  public:
    // `settings.mindist` is a distance here, no longer "the default". One set has `paths` light paths.
    VplShading(const Scene& scene, const IgiSettings& settings, std::uint32_t paths)
        : scene_(scene), geometry_(settings.mindist, settings.glimit), paths_(static_cast<float>(paths)) {}

    const ClampedGeometry& geometry() const { return geometry_; }

    // Radiance towards the eye (in a medium: per unit of σ_s) from one light of a set of which all are asked,
    // times `throughput`. The sum over a set is one sample per light path: it is divided by the number of
    // paths. ([Pharr 2004] divides by the number of VPLs, of which a path makes several; that loses their
    // energy.) `Place` is a Vertex or a MediumVertex. Which lights get a shadow ray has been decided before
    // (igi_vpls.h); `sampler` is for media that are not even.
    template <typename Place>
    Rgb shade(const Place& place, const Vpl& light, const Rgb& throughput, Sampler& sampler) const {
        const SurfacePoint x = place.from();
        const V3f way = light.at.p - x.p;
        const float d2 = way.length2();
        if (!(d2 > 0)) return Rgb(0);  // a VPL on the very point lights nothing
        const float d = std::sqrt(d2);
        const V3f w = way / d;
        const float sent = light.towards(-w);
        if (!(sent > 0)) return Rgb(0);  // on a surface they shine on their side only
        const float cosines = cosine_at(place, w) * (light.in_medium ? 1.0F : sent);
        const float clamped = geometry_.clamped(d2, cosines, x.error + light.at.error);
        if (!(clamped > 0)) return Rgb(0);

        const Rgb value = throughput * place.value(w) * light.contribution * (clamped * sent / d2 / paths_);
        if (is_black(value)) return value;
        return value * passing(scene_, way_between(x, light.at), place.medium_towards(w), sampler);
    }

  private:
    const Scene& scene_;
    ClampedGeometry geometry_;
    float paths_;
};

}  // namespace lucerna
