// The sun: a disc of constant radiance at infinity. Directions are uniform in the cone that it subtends, and
// lines of one direction are uniform across the disc that covers the scene.
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"

namespace lucerna {
namespace {

class SunLight final : public Light {
  public:
    SunLight(const V3f& towards, double radius, const Rgb& irradiance, const SceneSphere& scene,
             FluxUnit unit)
        : Light(unit),
          frame_(towards.normalized()),
          one_minus_cos_(2 * sqr(sin(radius / 2))),
          // A plane that faces the disc receives L π sin² of its radius.
          radiance_(irradiance / static_cast<float>(kPiD * sqr(sin(radius)))),
          scene_(scene) {}

    std::string_view kind() const override { return "sun"; }
    bool is_at_infinity() const override { return true; }
    bool has_impostor() const override { return true; }
    Rgb flux() const override { return radiance_ * (solid_angle() * kPi * sqr(scene_.radius)); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(radiance_)) return std::nullopt;
        return particle_from_afar(scene_, Frame(-direction(u.direction)), u.position, flux());
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f& u, std::optional<CellId>) const override {
        if (is_black(radiance_)) return std::nullopt;
        return LightSample{direction(u), INFINITY, radiance_ * solid_angle(), 1 / solid_angle()};
    }

    // Rays with a finite end do not reach the sun.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (ray.t_max < INFINITY) return std::nullopt;
        // Half the squared chord is 1 - cosθ without cancellation.
        const double off = (V3d(ray.d) - V3d(frame_.n)).length2() / 2;
        if (off > one_minus_cos_) return std::nullopt;
        return EmittedRadiance{radiance_, 1 / solid_angle(), INFINITY};
    }

  private:
    float solid_angle() const { return static_cast<float>(2 * kPiD * one_minus_cos_); }
    V3f direction(const V2f& u) const {
        const double h = static_cast<double>(u.x) * one_minus_cos_;
        const auto r = static_cast<float>(std::sqrt(h * (2 - h)));
        const float phi = 2 * kPi * u.y;
        return frame_.to_world({r * cos(phi), r * sin(phi), static_cast<float>(1 - h)}).normalized();
    }

    Frame frame_;           // n points to the middle of the disc
    double one_minus_cos_;  // of the angle that the disc's radius subtends
    Rgb radiance_;          // W/(m² sr)
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_sun_light(const V3f& towards, double radius, const Rgb& irradiance,
                                      const SceneSphere& scene, FluxUnit unit) {
    return std::make_unique<SunLight>(towards, radius, irradiance, scene, unit);
}

}  // namespace lucerna
