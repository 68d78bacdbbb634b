// Classifies the bounces of particles, and corrects them for shading normals.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"

namespace lucerna {

// Whether a bounce of a light path counts as specular: what the maps are told apart by.
//
// A delta always does. Gloss does if its alpha lies below a stated bound; where one surface has both gloss
// that does and lobes that do not, the direction alone does not say which of them it came from. Both could
// have drawn it, so the class is drawn, too, by what each reflects that way, and the power is scaled to what
// that part reflects: each map then holds its own part in the mean, and both together all of it.

struct BounceClass {
    bool specular;
    Rgb scale{1.0F};  // of the power that was scattered; leaves its luminance as it is but for colours' sake
};

inline BounceClass classify(const Bsdf& bsdf, const V3f& wo, const BsdfSample& sample, float specular_below,
                            Sampler& sampler) {
    if (sample.delta) return {true};
    if (!(specular_below > 0)) return {false};
    const Bsdf sharp = bsdf.sharp_part(specular_below);
    if (sharp.is_black()) return {false};
    const Rgb all = bsdf.f(wo, sample.wi, Transport::particles);
    const Rgb part = sharp.f(wo, sample.wi, Transport::particles);
    if (!(luminance(all) > 0)) return {false};  // only by rounding: the sample had weight
    const float chance = std::min(1.0F, luminance(part) / luminance(all));
    const bool specular = sampler.next() < chance;  // never where the chance is 0, always where it is 1
    const float taken = specular ? chance : 1 - chance;
    Rgb scale(0.0F);
    for (int c = 0; c < 3; ++c) {
        if (all[c] > 0) scale[c] = (specular ? part[c] : std::max(0.0F, all[c] - part[c])) / (all[c] * taken);
    }
    return {specular, scale};
}

// The correction for shading normals, by which particles see the same surface as the path tracer.

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
