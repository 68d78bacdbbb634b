// Implements the anisotropic GGX distribution of facets with Smith's masking, sampled by visible normals.
//
// Sources: Walter, Marschner, Li, Torrance, "Microfacet Models for Refraction through Rough Surfaces", 2007;
// [Heitz 2014; Heitz 2018].
//
// All vectors are local and unit; z is the shading normal. The sources write Smith's Λ = (s/cosθ - 1)/2; this
// file keeps s = |(αx x, αy y, z)|, so that every quotient of the model is finite up to and at grazing: s is
// at least the smaller alpha.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {

class Ggx {
  public:
    // Requires both alphas > 0.
    Ggx(float alpha_x, float alpha_y) : ax_(alpha_x), ay_(alpha_y) {}

    // Returns D(m), the facet area per solid angle of m and area of surface, 1/sr.
    float density(const V3f& m) const {
        const float e = sqr(m.x / ax_) + sqr(m.y / ay_) + m.z * m.z;  // >= min(1, 1/α²) for a unit m
        return 1 / (kPi * ax_ * ay_ * e * e);
    }

    // Returns s as defined at the top of this file.
    float stretch(const V3f& w) const { return std::sqrt(sqr(ax_ * w.x) + sqr(ay_ * w.y) + w.z * w.z); }

    // Returns G1(w) / |cosθ_w| [Heitz 2014, (43)] for a direction on either side.
    float masking_over_cos(const V3f& w) const { return 2 / (std::fabs(w.z) + stretch(w)); }
    // Returns G1(w) = 1 / (1 + Λ).
    float masking(const V3f& w) const { return masking_over_cos(w) * std::fabs(w.z); }
    // Returns G2(o, i) / (cos_o cos_i) for two directions on the upper side, height-correlated: 1 / (1 + Λ_o
    // + Λ_i) [Heitz 2014, (99)]. The cosines must not both be 0.
    float masking_shadowing_over_cos2(const V3f& o, const V3f& i) const {
        return 2 / (stretch(o) * i.z + stretch(i) * o.z);
    }
    // Returns G2(o, i) / G1(o) in [0,1] for two upper directions: the unshadowed share of a visible facet.
    float shadowing_if_visible(const V3f& o, const V3f& i) const {
        const float so = stretch(o);
        return i.z * (o.z + so) / (so * i.z + stretch(i) * o.z);
    }

    // Returns the density per solid angle of m among the facets seen from wo (wo.z >= 0): G1(wo) max(0, wo·m)
    // D(m) / wo.z.
    float visible_density(const V3f& wo, const V3f& m) const {
        return masking_over_cos(wo) * std::max(0.0F, wo.dot(m)) * density(m);
    }
    // Draws m with visible_density [Heitz 2018, appendix A].
    V3f sample_visible(const V3f& wo, const V2f& u) const {
        // Stretch the surface until the facets are distributed as those of a hemisphere.
        const V3f v = V3f(ax_ * wo.x, ay_ * wo.y, wo.z).normalized();
        const float across2 = v.x * v.x + v.y * v.y;
        const V3f t1 = across2 > 0 ? V3f(-v.y, v.x, 0) / std::sqrt(across2) : V3f(1, 0, 0);
        const V3f t2 = v.cross(t1);
        // Draw a point of the hemisphere's projection along v: half a disc and half an ellipse.
        const float r = std::sqrt(u.x);
        const float phi = 2 * kPi * u.y;
        const float p1 = r * cos(phi);
        const float half = 0.5F * (1 + v.z);
        const float p2 = (1 - half) * std::sqrt(std::max(0.0F, 1 - p1 * p1)) + half * r * sin(phi);
        const V3f h = p1 * t1 + p2 * t2 + std::sqrt(std::max(0.0F, 1 - p1 * p1 - p2 * p2)) * v;
        // Stretch back; normals transform by the inverse transpose.
        return V3f(ax_ * h.x, ay_ * h.y, std::max(0.0F, h.z)).normalized();
    }

  private:
    float ax_, ay_;
};

// Returns the mean of weight(m), in [0,1], over facets seen from wo (wo.z > 0), which approximates a rough
// lobe's albedo. The points form a golden spiral: GGX's long tail puts the facets that reflect into the
// surface near the rim of the disc that sample_visible maps, at a radius that depends on alpha, and the
// spiral has every radius once. With 64 points the albedo errs by up to 0.021, with 128 by 0.016, with 256 by
// 0.010 (the worst of both rough lobes over angles and alphas).
template <std::uint32_t kFacets = 256, typename Weight>
Rgb mean_over_visible(const Ggx& facets, const V3f& wo, Weight&& weight) {
    constexpr float kGolden = 0.61803399F;
    Rgb sum(0.0F);
    for (std::uint32_t i = 0; i < kFacets; ++i) {
        const float k = static_cast<float>(i) + 0.5F;
        const float turn = k * kGolden;
        sum += weight(facets.sample_visible(wo, {k / kFacets, turn - std::floor(turn)}));
    }
    sum /= static_cast<float>(kFacets);  // every weight is at most 1, and the mean up to rounding
    return at_most_one(sum);
}

}  // namespace lucerna
