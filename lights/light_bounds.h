// Where a light is and which way it shines, bounded: what a choice among many lights goes by.
//
// Source: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018
// [CK18].
#pragma once

#include "engine/base/vec.h"

namespace lucerna {

struct LightBounds {
    Box3f box;          // scene units
    V3f axis{0, 0, 1};  // unit; of the emitting normals
    // All normals lie within theta_o of the axis, all light within theta_e of some normal [rad].
    float theta_o = kPi, theta_e = kPi / 2;
    float power = 0;  // >= 0, in any unit that all share
};

// Bounds of both.
LightBounds together(const LightBounds& a, const LightBounds& b);

// What a bound promises at other places: the same, ready to be asked many times.
class LightPromise {
  public:
    LightPromise() = default;
    explicit LightPromise(const LightBounds& bounds);

    // How much may arrive at x, up to a factor that does not depend on the light: 0 only where nothing can.
    // `n` is the normal of an opaque surface, on the side seen, or 0.
    float at(const V3f& x, const V3f& n) const;

  private:
    V3f centre_{0, 0, 0}, axis_{0, 0, 1};
    float r2_ = 0;  // of the sphere around the box, squared
    float cos_o_ = -1, sin_o_ = 0, cos_e_ = 0;
    float power_ = 0;
};

}  // namespace lucerna
