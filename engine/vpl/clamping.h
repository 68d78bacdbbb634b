// Clamping of the geometry term of near VPLs [Pharr 2004; Kollig and Keller 2004].
//
// A VPL sends cosθ_x cosθ_y / d² to a place x: without bound as d goes to 0, which one sees as a bright spot
// around it. So of each pair (x, y) a share, clamped(), is taken, and the rest is cut off: by a fade over
// distance [Pharr 2004], by a clamp of the factor [Kollig and Keller 2004], or by both. It depends on the
// pair alone: a ray from x that meets y can put back exactly what was cut, residual() = 1 - clamped().
#pragma once

#include <algorithm>

#include "engine/scene/vertex.h"

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

}  // namespace lucerna
