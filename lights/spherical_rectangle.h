// A rectangle as it is seen from a place: its solid angle, and points of it that are uniform in solid angle.
//
// Source: [Ureña 2013]. Each angle of the spherical quadrilateral is written with atan2, which keeps
// its digits where the paper's arc cosine loses half of them.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {

class SphericalRectangle {
  public:
    // The rectangle lies in the plane at the distance z > 0 from the place, between the coordinates x0 < x1
    // and y0 < y1 relative to the place's foot in the plane.
    SphericalRectangle(double x0, double x1, double y0, double y1, double z)
        : x0_(x0), x1_(x1), y0_(y0), y1_(y1), z_(z) {
        // corner(x, y) is π/2 less the solid angle of the rectangle between the foot and (x, y).
        const auto corner = [z](double x, double y) {
            return atan2(z * std::sqrt(x * x + y * y + z * z), x * y);
        };
        const double c00 = corner(x0, y0), c01 = corner(x0, y1);
        start_ = c00 - c01;
        solid_angle_ = std::max(0.0, corner(x1, y0) - corner(x1, y1) - start_);
    }

    double solid_angle() const { return solid_angle_; }  // [sr]

    // Draws a point of the plane, uniformly in solid angle. Rounding loses digits where the solid angle is
    // tiny; the point always lies in the rectangle.
    Imath::V2d draw(double u, double v) const {
        const double angle = u * solid_angle_ + start_;
        const double b0 = -y0_ / hypot(z_, y0_), b1 = y1_ / hypot(z_, y1_);
        const double sine = sin(angle);
        double x = 0;
        if (sine != 0) {
            const double f = (cos(angle) * b0 + b1) / sine;
            const double c = std::copysign(1 / std::sqrt(f * f + b0 * b0), f);
            const double s2 = 1 - c * c;
            x = s2 > 0 ? c * z_ / std::sqrt(s2) : std::copysign(INFINITY, c);
        }
        x = std::clamp(x, x0_, x1_);
        const double d = hypot(x, z_);
        const double h0 = y0_ / hypot(d, y0_), h1 = y1_ / hypot(d, y1_);
        const double h = h0 + v * (h1 - h0), rest = 1 - h * h;
        const double y = rest > 0 ? h * d / std::sqrt(rest) : y1_;
        return {x, std::clamp(y, y0_, y1_)};
    }

  private:
    double x0_, x1_, y0_, y1_, z_;
    double start_;
    double solid_angle_;
};

}  // namespace lucerna
