// What one virtual light sends to a place, and from there on towards the eye [igi 3].
#pragma once

#include "engine/base/stream.h"
#include "engine/render/direct_light.h"
#include "engine/render/igi_bound.h"
#include "engine/render/settings.h"
#include "photon/virtual_lights.h"

namespace lucerna {

class VirtualLightShading {
  public:
    // `settings.mindist` is a distance here, no longer "the default". One set has `paths` light paths.
    VirtualLightShading(const Scene& scene, const IgiSettings& settings, std::uint32_t paths)
        : scene_(scene), bound_(settings.mindist, settings.glimit), paths_(static_cast<float>(paths)) {}

    const NearBound& bound() const { return bound_; }

    // Radiance towards the eye (in a medium: per unit of σ_s) from one light of a set of which all are asked,
    // times `worth`. The sum over a set is one sample per light path: it is divided by the number of paths.
    // (The note's listing divides by the number of virtual lights, of which a path makes several; that loses
    // their energy.) `Place` is a Vertex or a MediumVertex. Which lights get a shadow ray has been decided
    // before (igi_lights.h); `stream` is for media that are not even.
    template <typename Place>
    Rgb shade(const Place& place, const VirtualLight& light, const Rgb& worth, Stream& stream) const {
        const SurfacePoint x = place.from();
        const V3f way = light.at.p - x.p;
        const float d2 = way.length2();
        if (!(d2 > 0)) return Rgb(0);  // a virtual light on the very point lights nothing
        const float d = std::sqrt(d2);
        const V3f w = way / d;
        const float sent = light.towards(-w);
        if (!(sent > 0)) return Rgb(0);  // on a surface they shine on their side only
        const float cosines = cosine_at(place, w) * (light.in_medium ? 1.0F : sent);
        const float kept = bound_.kept(d2, cosines, x.error + light.at.error);
        if (!(kept > 0)) return Rgb(0);

        const Rgb value = worth * place.value(w) * light.contribution * (kept * sent / d2 / paths_);
        if (is_black(value)) return value;
        if (!visible_between(scene_, x, light.at)) return Rgb(0);
        return value * passage(scene_, x, w, d, place.medium_towards(w), stream);
    }

  private:
    const Scene& scene_;
    NearBound bound_;
    float paths_;
};

}  // namespace lucerna
