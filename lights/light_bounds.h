// Bounds on a light's place and directions, by which a choice among many lights is made.
//
// Source: [Conty Estevez and Kulla 2018].
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

struct LightBounds {
    Box3f box;  // scene units
    // Unit: the axis of the cone of emitting normals, and of a lamp with a frame of its own, its +z.
    V3f axis{0, 0, 1};
    // All normals lie within theta_o of the axis, and all light leaves within theta_e of some normal [rad].
    float theta_o = kPi, theta_e = kPi / 2;
    bool two_sided = false;  // the same light also leaves to the opposite side of the axis
    float power = 0;         // >= 0, in any unit that all lights share
};

// Returns bounds that contain both.
LightBounds union_of(const LightBounds& a, const LightBounds& b);
// Returns bounds that contain all of `all`, at least one; their cone's axis is the mean of the axes.
LightBounds union_of(std::span<const LightBounds> all);

// Computes a light's importance on plain numbers and without branches, so that loops over many bounds compile
// to vector instructions.
namespace light_importance {

inline constexpr float kSlack = 1e-3F;  // keeps rounding from making a light impossible

// Return the cosine and sine of max(0, a - b), for angles in [0, π] given by their cosines and sines.
inline float cos_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 1.0F : cos_a * cos_b + sin_a * sin_b;
}
inline float sin_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 0.0F : sin_a * cos_b - cos_a * sin_b;
}
inline float sine(float cosine) {
    return std::sqrt(std::max(0.0F, 1 - cosine * cosine));
}

// Holds the largest angle u that a sphere of squared radius r2 subtends around its centre's direction, seen
// from squared distance d2. It is subtracted from every other angle.
struct Filled {
    float cos_u, sin_u;
    Filled(float d2, float r2) {
        const bool inside = !(d2 > r2);
        const float outside = std::sqrt(std::max(0.0F, 1 - r2 / std::max(d2, 1e-37F)));
        cos_u = inside ? -1.0F : outside;
        sin_u = inside ? 0.0F : sine(outside);
    }
    float cos_of_rest(float cosine) const {
        return light_importance::cos_of_rest(cosine, sine(cosine), cos_u, sin_u);
    }
};

// Bounds the share of a light's intensity that points at a place at angle `w` from the axis.
inline float shining(const Filled& filled, float cos_w, float cos_o, float sin_o, float cos_e) {
    const float sin_w = sine(cos_w);
    const float cos_x = cos_of_rest(cos_w, sin_w, cos_o, sin_o);
    const float sin_x = sin_of_rest(cos_w, sin_w, cos_o, sin_o);
    const float cos_left = cos_of_rest(cos_x, sin_x, filled.cos_u, filled.sin_u);
    return cos_left < cos_e - kSlack ? 0.0F : std::max(cos_left, kSlack);
}

// Bounds the share of the arriving light that a surface receives, at angle `i` from its normal.
inline float receiving(const Filled& filled, float cos_i) {
    const float cos_n = filled.cos_of_rest(cos_i);
    // Bump mapping bends the normal that gives the cosine, so grazing light keeps a chance.
    return cos_n < -kSlack ? 0.0F : 0.1F + 0.9F * std::max(cos_n, 0.0F);
}

}  // namespace light_importance

// Evaluates the importance of a bound at many places. It caches what depends on the bound alone.
class LightImportance {
  public:
    LightImportance() = default;
    explicit LightImportance(const LightBounds& bounds);

    // Returns how much light may arrive at x, up to a factor common to all lights. It is 0 only where none
    // can arrive. `n` is the normal of an opaque surface on the side seen, or 0.
    float at(const V3f& x, const V3f& n) const;
    // As above, for a light with an estimate Light::arriving(). The bound keeps a share, because an estimate
    // of 0 does not prove that nothing arrives.
    float at(const V3f& x, const V3f& n, float arriving) const;

  private:
    struct Seen;
    Seen seen_from(const V3f& x, const V3f& n) const;

    V3f centre_{0, 0, 0}, axis_{0, 0, 1};
    float r2_ = 0;  // squared radius of the sphere around the box
    bool two_sided_ = false;
    float cos_o_ = -1, sin_o_ = 0, cos_e_ = 0;
    float power_ = 0;
};

}  // namespace lucerna
