// How a medium turns light: the phase function of Henyey and Greenstein 1941.
//
// Directions are unit vectors that point away from the scattering point, as at a surface: `wo` towards the
// eye, `wi` towards the light. Light that goes straight on has wo·wi = -1. g is the mean cosine between the
// directions of travel before and after: 0 is the same everywhere, towards 1 more and more forward.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/vec.h"

namespace lucerna {

// Beyond this a float32 cannot resolve the peak.
inline constexpr float kLargestG = 0.999F;

class HenyeyGreenstein {
  public:
    // |g| <= kLargestG.
    explicit HenyeyGreenstein(float g) : g_(g) {}

    float g() const { return g_; }

    // Density per solid angle of scattering from one direction to the other; also what sample() draws with,
    // so a sample's weight is 1.
    float value(const V3f& wo, const V3f& wi) const { return at_cosine(-wo.dot(wi)); }

    // Of the cosine between the directions of travel; in 1/sr.
    float at_cosine(float cosine) const {
        // At least (1 - |g|)², so the power is never of 0.
        const float d = std::max(sqr(1 - std::fabs(g_)), 1 + g_ * g_ - 2 * g_ * cosine);
        return 0.25F * kInvPi * (1 - g_ * g_) / (d * std::sqrt(d));
    }

    V3f sample(const V3f& wo, const V2f& u) const {
        // The usual inverse of the distribution divides by g. With x = 2u - 1 and that division carried out:
        // cosθ = (x + g(x² + 3)/2 + g²x + g³(x² - 1)/2) / (1 + gx)², good for every g; 1 + gx >= 1 - |g|.
        const float x = 2 * u.x - 1;
        const float g = g_;
        const float above = x + g * (x * x + 3) / 2 + g * g * x + g * g * g * (x * x - 1) / 2;
        const float cosine = std::clamp(above / sqr(1 + g * x), -1.0F, 1.0F);
        const float sine = std::sqrt(std::max(0.0F, 1 - cosine * cosine));
        const float phi = 2 * kPi * u.y;
        const Frame along(-wo);
        return along.to_world({sine * std::cos(phi), sine * std::sin(phi), cosine}).normalized();
    }

  private:
    float g_;
};

}  // namespace lucerna
