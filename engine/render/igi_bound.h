// Where virtual lights are too near to be believed [igi 3, 4].
//
// A virtual light sends cosθ_x cosθ_y / d² to a place x: without bound as d goes to 0, which one sees as a
// bright spot around it. So a share of each pair (x, y) is kept, `kept`, and the rest is cut off: by a fade
// over distance (the note's), by a clamp of the factor (Kollig and Keller, "Illumination in the presence of
// weak singularities", 2004), or by both. It depends on the pair alone: a ray from x that meets y can put
// back exactly what was cut, 1 - kept.
#pragma once

#include <algorithm>

#include "engine/render/direct_light.h"

namespace lucerna {

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

class NearBound {
  public:
    // `mindist` in scene units, 0: no fade. `glimit` in 1/(scene unit)², 0: no clamp.
    NearBound(float mindist, float glimit) : min2_(sqr(mindist)), glimit_(glimit) {}

    // Of what a virtual light at y would send to x, in [0,1]. `cosines`: |cosθ_x| |cosθ_y|, in a medium 1
    // each. `error`: how far the two may lie off what they stand for; nearer than that, G has no value.
    float kept(float d2, float cosines, float error) const {
        if (!(d2 > sqr(error))) return 0;
        const float faded = smoothstep(0.8F * min2_, 1.2F * min2_, d2);
        const float most = glimit_ * d2;  // of the cosines
        if (!(glimit_ > 0) || cosines <= most) return faded;
        return faded * most / cosines;  // cosines > most >= 0
    }

  private:
    float min2_, glimit_;
};

}  // namespace lucerna
