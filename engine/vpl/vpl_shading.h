// What one VPL sends to a place, and from there on towards the eye [Pharr 2004].
#pragma once

#include "engine/base/sampler.h"
#include "engine/scene/vertex.h"
#include "engine/vpl/clamping.h"
#include "engine/vpl/igi_settings.h"
#include "engine/vpl/vpl.h"

namespace lucerna {

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
        if (!visible_between(scene_, x, light.at)) return Rgb(0);
        return value * passage(scene_, x, w, d, place.medium_towards(w), sampler);
    }

  private:
    const Scene& scene_;
    ClampedGeometry geometry_;
    float paths_;
};

}  // namespace lucerna
