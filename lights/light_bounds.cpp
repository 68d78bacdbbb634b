#include "lights/light_bounds.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {

LightImportance::LightImportance(const LightBounds& bounds)
    : centre_(0.5F * (bounds.box.min + bounds.box.max)),
      axis_(bounds.axis),
      r2_(0.25F * bounds.box.size().length2()),
      two_sided_(bounds.two_sided),
      cos_o_(cos(bounds.theta_o)),
      sin_o_(sin(bounds.theta_o)),
      cos_e_(cos(bounds.theta_e)),
      power_(bounds.power) {}

// Splits the importance at a place into the bound on what arrives and the share that the surface receives.
struct LightImportance::Seen {
    float bound, receiving;
};

LightImportance::Seen LightImportance::seen_from(const V3f& x, const V3f& n) const {
    if (!(power_ > 0)) return {0, 0};
    const V3f way = x - centre_;
    const float d2 = way.length2();
    const float d = std::sqrt(d2);
    const V3f w = d > 0 ? way / d : axis_;  // from the light to x

    const light_importance::Filled filled(d2, r2_);
    const float cos_axis = std::clamp(axis_.dot(w), -1.0F, 1.0F);
    const float cos_w = two_sided_ ? std::fabs(cos_axis) : cos_axis;
    const float shining = light_importance::shining(filled, cos_w, cos_o_, sin_o_, cos_e_);
    // A place within the box counts as being on its bounding sphere, since nothing more is known. The last
    // bound is for x at a point light.
    const float bound = power_ * shining / std::max({d2, r2_, 1e-30F});
    if (n == V3f(0.0F)) return {bound, 1};
    return {bound, light_importance::receiving(filled, std::clamp(-n.dot(w), -1.0F, 1.0F))};
}

float LightImportance::at(const V3f& x, const V3f& n) const {
    const Seen seen = seen_from(x, n);
    return seen.bound * seen.receiving;
}

float LightImportance::at(const V3f& x, const V3f& n, float arriving) const {
    constexpr float kByBounds = 0.1F;
    const Seen seen = seen_from(x, n);
    if (!(seen.bound > 0)) return 0;
    // A Lambertian source of this power sends bound / π to a surface that faces it.
    return (kByBounds * seen.bound + (1 - kByBounds) * kPi * power_ * arriving) * seen.receiving;
}

LightBounds union_of(const LightBounds& a, const LightBounds& b) {
    LightBounds all = a;
    all.box.extendBy(b.box);
    all.theta_e = std::max(a.theta_e, b.theta_e);
    all.power = a.power + b.power;
    all.two_sided = a.two_sided || b.two_sided;
    // A two-sided bound may flip its axis.
    const bool turned = all.two_sided && a.axis.dot(b.axis) < 0;
    const V3f a_axis = turned && a.two_sided ? -a.axis : a.axis;
    const V3f b_axis = turned && !a.two_sided ? -b.axis : b.axis;
    all.axis = a_axis;
    // Finds the narrowest cone around both.
    const float apart = acos(std::clamp(a_axis.dot(b_axis), -1.0F, 1.0F));
    if (std::min(apart + b.theta_o, kPi) <= a.theta_o) return all;
    if (std::min(apart + a.theta_o, kPi) <= b.theta_o) {
        all.axis = b_axis;
        all.theta_o = b.theta_o;
        return all;
    }
    all.theta_o = 0.5F * (a.theta_o + apart + b.theta_o);
    const V3f side = b_axis - a_axis.dot(b_axis) * a_axis;
    if (all.theta_o >= kPi || !(side.length2() > 1e-12F)) {  // opposite axes have no plane between them
        all.theta_o = kPi;
        return all;
    }
    const float turn = all.theta_o - a.theta_o;
    all.axis = (cos(turn) * a_axis + sin(turn) * side.normalized()).normalized();
    return all;
}

LightBounds union_of(std::span<const LightBounds> all) {
    assert(!all.empty());
    LightBounds result = all.front();
    V3d sum(0.0);
    for (const LightBounds& one : all) sum += V3d(one.axis);
    if (sum.length2() > 1e-12) result.axis = V3f(sum.normalized());
    result.theta_o = 0;
    result.power = 0;
    for (const LightBounds& one : all) {
        result.box.extendBy(one.box);
        result.theta_e = std::max(result.theta_e, one.theta_e);
        result.power += one.power;
        // atan2 is accurate for small angles, where acos of the dot product is not.
        const float apart = atan2(result.axis.cross(one.axis).length(), result.axis.dot(one.axis));
        result.theta_o = std::max(result.theta_o, std::min(apart + one.theta_o, kPi));
    }
    return result;
}

}  // namespace lucerna
