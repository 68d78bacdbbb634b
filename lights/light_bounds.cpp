#include "lights/light_bounds.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// cos(max(0, a - b)) for angles in [0, π] given by their cosines and sines: what is left of `a` after `b`.
float cos_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 1.0F : cos_a * cos_b + sin_a * sin_b;
}
float sin_of_rest(float cos_a, float sin_a, float cos_b, float sin_b) {
    return cos_a > cos_b ? 0.0F : sin_a * cos_b - cos_a * sin_b;
}
float sine(float cosine) {
    return std::sqrt(std::max(0.0F, 1 - cosine * cosine));
}

}  // namespace

LightPromise::LightPromise(const LightBounds& bounds)
    : centre_(0.5F * (bounds.box.min + bounds.box.max)),
      axis_(bounds.axis),
      r2_(0.25F * bounds.box.size().length2()),
      cos_o_(std::cos(bounds.theta_o)),
      sin_o_(std::sin(bounds.theta_o)),
      cos_e_(std::cos(bounds.theta_e)),
      power_(bounds.power) {}

float LightPromise::at(const V3f& x, const V3f& n) const {
    if (!(power_ > 0)) return 0;
    const V3f way = x - centre_;
    const float d2 = way.length2();
    const float d = std::sqrt(d2);
    const V3f w = d > 0 ? way / d : axis_;  // from the light to x

    // The angle that the box fills at most, seen from x, is taken off every other one.
    const bool inside = !(d2 > r2_);
    const float cos_u = inside ? -1.0F : std::sqrt(std::max(0.0F, 1 - r2_ / d2));
    const float sin_u = inside ? 0.0F : sine(cos_u);
    const float cos_w = std::clamp(axis_.dot(w), -1.0F, 1.0F), sin_w = sine(cos_w);
    const float cos_x = cos_of_rest(cos_w, sin_w, cos_o_, sin_o_);
    const float sin_x = sin_of_rest(cos_w, sin_w, cos_o_, sin_o_);
    const float cos_left = cos_of_rest(cos_x, sin_x, cos_u, sin_u);
    constexpr float kSlack = 1e-3F;  // rounding must not make a light impossible
    if (cos_left < cos_e_ - kSlack) return 0;

    // A place within the box is as near as its rim, for all that is known; the last bound is for a point
    // light at x.
    float result = power_ * std::max(cos_left, kSlack) / std::max({d2, r2_, 1e-30F});
    if (n != V3f(0.0F)) {
        const float cos_i = std::clamp(-n.dot(w), -1.0F, 1.0F);
        const float cos_n = cos_of_rest(cos_i, sine(cos_i), cos_u, sin_u);
        if (cos_n < -kSlack) return 0;
        // Relief bends the normal that gives the cosine: grazing light keeps a chance.
        result *= 0.1F + 0.9F * std::max(cos_n, 0.0F);
    }
    return result;
}

LightBounds together(const LightBounds& a, const LightBounds& b) {
    LightBounds all = a;
    all.box.extendBy(b.box);
    all.theta_e = std::max(a.theta_e, b.theta_e);
    all.power = a.power + b.power;
    // The narrowest cone around both.
    const float apart = std::acos(std::clamp(a.axis.dot(b.axis), -1.0F, 1.0F));
    if (std::min(apart + b.theta_o, kPi) <= a.theta_o) return all;
    if (std::min(apart + a.theta_o, kPi) <= b.theta_o) {
        all.axis = b.axis;
        all.theta_o = b.theta_o;
        return all;
    }
    all.theta_o = 0.5F * (a.theta_o + apart + b.theta_o);
    const V3f side = b.axis - a.axis.dot(b.axis) * a.axis;
    if (all.theta_o >= kPi || !(side.length2() > 1e-12F)) {  // opposite axes have no plane between them
        all.theta_o = kPi;
        return all;
    }
    const float turn = all.theta_o - a.theta_o;
    all.axis = (std::cos(turn) * a.axis + std::sin(turn) * side.normalized()).normalized();
    return all;
}

}  // namespace lucerna
