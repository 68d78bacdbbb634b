// pbrt's spot light. With c = cosθ from the axis, the intensity is I · s((c - c_total)/(c_start - c_total)),
// where s(t) = 3t² - 2t³ on [0,1], 0 below and 1 above. Its mean over the rim is 1/2 and its integral from 0
// is t³ - t⁴/2, so the flux is 2πI [(1 - c_start) + (c_start - c_total)/2], and directions are drawn by the
// intensity itself.
#include <algorithm>
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"

namespace lucerna {
namespace {

// 1 - cosθ, exact for thin cones.
double one_minus_cos(double radians) {
    return 2 * sqr(std::sin(radians / 2));
}

// The t in [0,1] with 2t³ - t⁴ = u: Newton's method kept between bounds by bisection.
double invert_rim(double u) {
    double low = 0;
    double high = 1;
    double t = std::cbrt(u / 2);  // exact at both ends but for a factor near 1
    for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
        const double f = t * t * t * (2 - t) - u;
        if (std::fabs(f) < 1e-14) break;
        (f < 0 ? low : high) = t;
        const double slope = t * t * (6 - 4 * t);
        const double next = slope > 0 ? t - f / slope : low;
        t = next > low && next < high ? next : 0.5 * (low + high);
    }
    return t;
}

class SpotLight final : public Light {
  public:
    SpotLight(const V3f& position, const V3f& axis, const Rgb& intensity, float cone_degrees,
              float delta_degrees)
        : position_(position), frame_(axis.normalized()), intensity_(intensity) {
        const double cone = std::clamp(static_cast<double>(cone_degrees), 0.0, 180.0);
        const double start = std::clamp(cone - static_cast<double>(delta_degrees), 0.0, cone);
        start_ = one_minus_cos(start * kRadiansPerDegree);
        total_ = one_minus_cos(cone * kRadiansPerDegree);
    }

    std::string_view kind() const override { return "spot"; }
    bool is_delta() const override { return true; }
    Rgb flux() const override { return intensity_ * static_cast<float>(solid_angle()); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(intensity_) || !(solid_angle() > 0)) return std::nullopt;
        const double part = static_cast<double>(u.direction.x) * (start_ + rim() / 2);
        // Within the full part uniform in the cosine; within the rim by the inverse of its integral.
        const double h = part < start_ ? part : total_ - rim() * invert_rim(rim_u(part));
        const double r = std::sqrt(std::max(0.0, h * (2 - h)));
        const float phi = 2 * kPi * u.direction.y;
        const V3f local(static_cast<float>(r) * std::cos(phi), static_cast<float>(r) * std::sin(phi),
                        static_cast<float>(1 - h));
        return LeSample{{position_}, frame_.to_world(local).normalized(), flux()};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f&, std::optional<CellId>) const override {
        const V3d way = V3d(x) - V3d(position_);
        const double r = way.length();
        if (!(r > 0)) return std::nullopt;
        // 1 - cosθ as half the squared chord between unit vectors: no cancellation near the axis.
        const double h = 0.5 * (way / r - V3d(frame_.n)).length2();
        return sample_Li_from_point(position_, x, intensity_ * static_cast<float>(falloff(h)));
    }
    // The same all over the cone, for all that is said here.
    std::optional<LightBounds> bounds() const override {
        const auto cone = static_cast<float>(2 * std::asin(std::sqrt(std::min(1.0, total_ / 2))));
        return LightBounds{Box3f(position_), frame_.n, cone, 0};
    }

  private:
    double rim() const { return total_ - start_; }
    double solid_angle() const { return 2 * kPiD * (start_ + rim() / 2); }  // sr, weighted

    // The rim is emptiest at its outer edge: u = 0 there.
    double rim_u(double part) const {
        return rim() > 0 ? std::clamp(1 - (part - start_) / (rim() / 2), 0.0, 1.0) : 1.0;
    }

    double falloff(double h) const {
        if (h <= start_) return 1;
        if (h >= total_) return 0;
        const double t = (total_ - h) / rim();  // > 0: start < h < total
        return t * t * (3 - 2 * t);
    }

    V3f position_;                  // scene units
    Frame frame_;                   // n is the axis
    Rgb intensity_;                 // W/sr on the axis
    double start_ = 0, total_ = 0;  // 1 - cos of where the fall starts and where it ends
};

}  // namespace

std::unique_ptr<Light> make_spot_light(const V3f& position, const V3f& axis, const Rgb& intensity,
                                       float cone_degrees, float delta_degrees) {
    return std::make_unique<SpotLight>(position, axis, intensity, cone_degrees, delta_degrees);
}

}  // namespace lucerna
