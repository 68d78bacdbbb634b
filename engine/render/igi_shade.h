// What one virtual light sends to a place, and from there on towards the eye [igi 3].
#pragma once

#include "engine/base/stream.h"
#include "engine/render/direct_light.h"
#include "engine/render/settings.h"
#include "photon/virtual_lights.h"

namespace lucerna {

inline float smoothstep(float low, float high, float x) {
    if (x <= low) return 0;
    if (x >= high) return 1;  // also when low == high: the divisor below is never 0
    const float t = (x - low) / (high - low);
    return t * t * (3 - 2 * t);
}

class VirtualLightShading {
  public:
    // `settings.mindist` is a distance here, no longer "the default". One set has `paths` light paths.
    VirtualLightShading(const Scene& scene, const IgiSettings& settings, std::uint32_t paths)
        : scene_(scene), settings_(settings), paths_(static_cast<float>(paths)) {}

    // Radiance towards the eye (in a medium: per unit of σ_s) from one light of a set of which all are asked.
    // The sum over a set is one sample per light path: it is divided by the number of paths. (The note's
    // listing divides by the number of virtual lights, of which a path makes several; that loses their
    // energy.) `Place` is a Vertex or a MediumVertex. Draws from `roulette` in any case.
    template <typename Place>
    Rgb shade(const Place& place, const VirtualLight& light, Stream& roulette) const {
        const float u_shadow = roulette.next();
        const SurfacePoint x = place.from();
        const V3f way = light.at.p - x.p;
        const float d2 = way.length2();
        // A virtual light on the very point lights nothing: where d² cannot be told from 0, G has no value.
        if (!(d2 > sqr(x.error + light.at.error))) return Rgb(0);
        const float min2 = sqr(settings_.mindist);
        const float fade = smoothstep(0.8F * min2, 1.2F * min2, d2);
        const float d = std::sqrt(d2);
        const V3f w = way / d;
        const float sent = light.towards(-w);
        if (!(fade > 0) || !(sent > 0)) return Rgb(0);  // on a surface they shine on their side only

        Rgb value =
            place.value(w) * light.contribution * (fade * settings_.indirect_scale * sent / d2 / paths_);
        if (is_black(value)) return value;

        // Faint lights get their shadow ray only sometimes.
        if (luminance(value) < settings_.rr_threshold) {
            if (!(u_shadow < settings_.rr_continue)) return Rgb(0);
            value /= settings_.rr_continue;  // at least 1e-6
        }
        if (!visible_between(scene_, x, light.at)) return Rgb(0);
        return value * passage(scene_, x, w, d, place.medium_towards(w), roulette);
    }

  private:
    const Scene& scene_;
    IgiSettings settings_;
    float paths_;
};

}  // namespace lucerna
