// Computes the light that one VPL sends to a place, and from there towards the eye [Pharr 2004].
#pragma once

#include <algorithm>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl.h"

namespace lucerna {

// The geometry term of near VPLs is clamped [Pharr 2004; Kollig and Keller 2004].
//
// The factor cosθ_x cosθ_y / d² with which a VPL lights a place x has no bound as d goes to 0, which shows as
// a bright spot around the VPL. VPLs therefore bring only a share, clamped(), of each pair (x, y). It is due
// to a fade over distance [Pharr 2004], a bound of the factor [Kollig and Keller 2004], or both. It depends
// on the pair alone, so that a ray from x that meets y can restore exactly the rest, residual().

inline float smoothstep(float low, float high, float x) {
    if (x <= low) return 0;
    if (x >= high) return 1;  // also when low == high: the divisor below is never 0
    const float t = (x - low) / (high - low);
    return t * t * (3 - 2 * t);
}

// Returns the cosine with which a place receives light: 1 in a medium.
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

    // Returns the share of a VPL's light from y to x that counts, in [0,1]. `cosines` is |cosθ_x| |cosθ_y|,
    // in a medium 1 each. `error` is how far the points may be off; nearer than that the factor is
    // meaningless.
    float clamped(float d2, float cosines, float error) const {
        if (!(d2 > sqr(error))) return 0;
        const float faded = smoothstep(0.8F * min2_, 1.2F * min2_, d2);
        const float most = glimit_ * d2;  // largest product of cosines that is not clamped
        if (!(glimit_ > 0) || cosines <= most) return faded;
        return faded * most / cosines;  // cosines > most >= 0
    }
    // Returns the share that clamping cuts off, which a compensation ray restores.
    float residual(float d2, float cosines, float error) const { return 1 - clamped(d2, cosines, error); }

  private:
    float min2_, glimit_;
};

class VplShading {
  public:
    // `settings` are as with_distance() returns them. One set has `paths` light paths.
    VplShading(const Scene& scene, const IgiSettings& settings, std::uint32_t paths)
        : scene_(scene), geometry_(settings.mindist, settings.glimit), paths_(static_cast<float>(paths)) {}

    const ClampedGeometry& geometry() const { return geometry_; }

    // Returns the radiance towards the eye (in a medium: per unit of σ_s) from one light of a set of which
    // all are visited, times `throughput`. A set is one sample per light path, so that its sum is divided by
    // the number of paths. ([Pharr 2004] divides by the number of VPLs, of which a path makes several, and
    // thus loses energy.) `Place` is a Vertex or a MediumVertex. igi_vpls.h has chosen which lights get a
    // shadow ray; `sampler` is for inhomogeneous media.
    template <typename Place>
    Rgb shade(const Place& place, const Vpl& light, const Rgb& throughput, Sampler& sampler) const {
        const SurfacePoint x = place.from();
        const V3f way = light.at.p - x.p;
        const float d2 = way.length2();
        if (!(d2 > 0)) return Rgb(0);  // a VPL at the very point lights nothing
        const float d = std::sqrt(d2);
        const V3f w = way / d;
        const float sent = light.towards(-w);
        if (!(sent > 0)) return Rgb(0);  // a VPL on a surface shines on its own side only
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
