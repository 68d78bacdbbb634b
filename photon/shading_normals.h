// What particles must be told about shading normals, so that they see the surface that the path tracer sees.
#pragma once

#include <cmath>

#include "engine/scene/bsdf.h"

namespace lucerna {

// Both ratios below have no limit at grazing angles, where they weigh next to nothing; this bounds them.
inline constexpr float kMostShadingRatio = 8;

inline float bounded_ratio(float above, float below) {
    return above < kMostShadingRatio * below ? above / below
                                             : kMostShadingRatio;  // below > 0 in the first branch
}

// A photon lands in proportion to the geometric cosine, a shading point reflects in proportion to the shading
// one.
inline float shading_cosine_ratio(const Bsdf& bsdf, const V3f& wi) {
    const V3f& ns = bsdf.shading_normal();
    const V3f& ng = bsdf.geometric_normal();
    return ns == ng ? 1.0F : bounded_ratio(std::fabs(wi.dot(ns)), std::fabs(wi.dot(ng)));
}

// The adjoint of a BSDF under shading normals [Veach 1997, (5.19)]. 1 where the two normals agree.
inline float shading_correction(const Bsdf& bsdf, const V3f& arriving_from, const V3f& leaving_to) {
    const V3f& ns = bsdf.shading_normal();
    const V3f& ng = bsdf.geometric_normal();
    if (ns == ng) return 1;
    return bounded_ratio(std::fabs(arriving_from.dot(ns)) * std::fabs(leaving_to.dot(ng)),
                         std::fabs(arriving_from.dot(ng)) * std::fabs(leaving_to.dot(ns)));
}

}  // namespace lucerna
