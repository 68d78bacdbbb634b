// A point that shines alike in every direction.
#include <cmath>

#include "engine/base/warp.h"
#include "lights/analytic.h"

namespace lucerna {
namespace {

class PointLight final : public Light {
  public:
    PointLight(const V3f& position, const Rgb& intensity) : position_(position), intensity_(intensity) {}

    std::string_view kind() const override { return "point"; }
    bool is_delta() const override { return true; }
    Rgb flux() const override { return intensity_ * (4 * kPi); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(intensity_)) return std::nullopt;
        return LeSample{{position_}, square_to_sphere(u.direction), flux()};
    }

    std::optional<LightSample> sample_Li(const V3f& x, const V2f&, std::optional<CellId>) const override {
        return sample_Li_from_point(position_, x, intensity_);
    }
    std::optional<LightBounds> bounds() const override { return LightBounds{Box3f(position_)}; }

  private:
    V3f position_;   // scene units
    Rgb intensity_;  // W/sr
};

}  // namespace

std::optional<LightSample> sample_Li_from_point(const V3f& position, const V3f& x, const Rgb& intensity) {
    const V3d way = V3d(position) - V3d(x);
    const double r2 = way.length2();
    if (is_black(intensity) || !(r2 > 0)) return std::nullopt;
    const double r = std::sqrt(r2);
    const Rgb weight = intensity * static_cast<float>(1 / r2);
    if (!is_finite(weight)) return std::nullopt;  // x is the light itself, as far as float32 can tell
    // Lamps sit in ceilings: what lies at the point itself shall not hide it.
    const auto distance = static_cast<float>(r);
    return LightSample{V3f(way / r), std::fmax(0.0F, distance - surface_error(position, distance)), weight,
                       0};
}

std::unique_ptr<Light> make_point_light(const V3f& position, const Rgb& intensity) {
    return std::make_unique<PointLight>(position, intensity);
}

}  // namespace lucerna
