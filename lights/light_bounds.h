// Where a light is and which way it shines, bounded: what a choice among many lights goes by.
//
// Source: [Conty Estevez and Kulla 2018].
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

struct LightBounds {
    Box3f box;          // scene units
    V3f axis{0, 0, 1};  // unit; of the emitting normals
    // All normals lie within theta_o of the axis, all light within theta_e of some normal [rad].
    float theta_o = kPi, theta_e = kPi / 2;
    bool two_sided = false;  // the same light leaves to the other side of the axis
    float power = 0;         // >= 0, in any unit that all share
};

// Bounds of both.
LightBounds union_of(const LightBounds& a, const LightBounds& b);
// Bounds of all, at least one: the cone is around the mean of their axes.
LightBounds union_of(std::span<const LightBounds> all);

// The arithmetic of a light's importance, on plain numbers and without branches: loops over many bounds side
// by side turn into vector instructions.
namespace light_importance {

inline constexpr float kSlack = 1e-3F;  // rounding must not make a light impossible

// cos(max(0, a - b)) for angles in [0, π] given by their cosines and sines: what is left of `a` after `b`.
inline float cos_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 1.0F : cos_a * cos_b + sin_a * sin_b;
}
inline float sin_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 0.0F : sin_a * cos_b - cos_a * sin_b;
}
inline float sine(float cosine) {
    return std::sqrt(std::max(0.0F, 1 - cosine * cosine));
}

// The angle u that a sphere of squared radius r2 fills at most, seen from a distance whose square is d2: it
// is taken off every other angle.
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

// How much of a light's intensity points at a place, at most; `cos_w` is between the axis and the way to it.
inline float shining(const Filled& filled, float cos_w, float cos_o, float sin_o, float cos_e) {
    const float sin_w = sine(cos_w);
    const float cos_x = cos_of_rest(cos_w, sin_w, cos_o, sin_o);
    const float sin_x = sin_of_rest(cos_w, sin_w, cos_o, sin_o);
    const float cos_left = cos_of_rest(cos_x, sin_x, filled.cos_u, filled.sin_u);
    return cos_left < cos_e - kSlack ? 0.0F : std::max(cos_left, kSlack);
}

// How much of what arrives counts on a surface; `cos_i` is between its normal and the way to the light.
inline float receiving(const Filled& filled, float cos_i) {
    const float cos_n = filled.cos_of_rest(cos_i);
    // Relief bends the normal that gives the cosine: grazing light keeps a chance.
    return cos_n < -kSlack ? 0.0F : 0.1F + 0.9F * std::max(cos_n, 0.0F);
}

}  // namespace light_importance

// The importance of a bound at other places: the same, ready to be asked many times.
class LightImportance {
  public:
    LightImportance() = default;
    explicit LightImportance(const LightBounds& bounds);

    // How much may arrive at x, up to a factor that does not depend on the light: 0 only where nothing can.
    // `n` is the normal of an opaque surface, on the side seen, or 0.
    float at(const V3f& x, const V3f& n) const;
    // The same of a light that knows what arrives: Light::arriving(). Bounds keep a part of it, since an
    // estimate of 0 does not say that nothing arrives.
    float at(const V3f& x, const V3f& n, float arriving) const;

  private:
    struct Seen;
    Seen seen_from(const V3f& x, const V3f& n) const;

    V3f centre_{0, 0, 0}, axis_{0, 0, 1};
    float r2_ = 0;  // of the sphere around the box, squared
    bool two_sided_ = false;
    float cos_o_ = -1, sin_o_ = 0, cos_e_ = 0;
    float power_ = 0;
};

}  // namespace lucerna
