// Classifies the bounces of particles, and corrects them for shading normals.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"

namespace lucerna {

// Classifies a bounce of a light path as specular or not; the class decides which map a photon enters.
//
// A delta lobe always counts as specular, a glossy lobe if its alpha lies below a given bound. On a surface
// that also has other lobes, either part may have generated the sampled direction. The class is then drawn in
// proportion to what each part reflects that way, and the power is scaled to that part's reflectance: in the
// mean each map holds the light of its own part, and both together hold all light.

struct BounceClass {
    bool specular;
    Rgb scale{1.0F};  // factor on the scattered power; keeps its luminance unless the parts differ in colour
};

inline BounceClass classify(const Bsdf& bsdf, const V3f& wo, const BsdfSample& sample, float specular_below,
                            Sampler& sampler) {
    if (sample.delta) return {true};
    if (!(specular_below > 0)) return {false};
    const Bsdf sharp = bsdf.sharp_part(specular_below);
    if (sharp.is_black()) return {false};
    const Rgb all = bsdf.f(wo, sample.wi, Transport::particles);
    const Rgb part = sharp.f(wo, sample.wi, Transport::particles);
    if (!(luminance(all) > 0)) return {false};  // possible only by rounding: the sample had weight
    const float chance = std::min(1.0F, luminance(part) / luminance(all));
    const bool specular = sampler.next() < chance;  // never for chance 0, always for chance 1
    const float taken = specular ? chance : 1 - chance;
    Rgb scale(0.0F);
    for (int c = 0; c < 3; ++c) {
        if (all[c] > 0) scale[c] = (specular ? part[c] : std::max(0.0F, all[c] - part[c])) / (all[c] * taken);
    }
    return {specular, scale};
}

// Corrections for shading normals, by which particles see the same surface as the path tracer.

// Bounds the two ratios below, which diverge at grazing angles, where the light that they scale vanishes.
inline constexpr float kMostShadingRatio = 8;

inline float bounded_ratio(float above, float below) {
    return above < kMostShadingRatio * below ? above / below
                                             : kMostShadingRatio;  // below > 0 in the first branch
}

// Converts from the density at which photons land, proportional to the geometric cosine, to the shading
// cosine with which a shading point reflects.
inline float shading_cosine_ratio(const Bsdf& bsdf, const V3f& wi) {
    const V3f& ns = bsdf.shading_normal();
    const V3f& ng = bsdf.geometric_normal();
    return ns == ng ? 1.0F : bounded_ratio(std::fabs(wi.dot(ns)), std::fabs(wi.dot(ng)));
}

// Returns the correction of the adjoint BSDF for shading normals [Veach 1997, (5.19)]; 1 if both normals
// agree.
inline float shading_correction(const Bsdf& bsdf, const V3f& arriving_from, const V3f& leaving_to) {
    const V3f& ns = bsdf.shading_normal();
    const V3f& ng = bsdf.geometric_normal();
    if (ns == ng) return 1;
    return bounded_ratio(std::fabs(arriving_from.dot(ns)) * std::fabs(leaving_to.dot(ng)),
                         std::fabs(arriving_from.dot(ng)) * std::fabs(leaving_to.dot(ns)));
}

}  // namespace lucerna
