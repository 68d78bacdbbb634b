// Parallel light, as from the sun.
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"

namespace lucerna {
namespace {

class DistantLight final : public Light {
  public:
    DistantLight(const V3f& direction, const Rgb& irradiance, const SceneSphere& scene)
        : frame_(direction.normalized()), irradiance_(irradiance), scene_(scene) {}

    std::string_view kind() const override { return "distant"; }
    bool is_delta() const override { return true; }
    // Through the disc that covers the scene: what misses the scene is counted too.
    Rgb flux() const override { return irradiance_ * (kPi * sqr(scene_.radius)); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(irradiance_)) return std::nullopt;
        const V2f disc = scene_.radius * square_to_disc(u.position);
        const V3f p = scene_.centre + frame_.to_world({disc.x, disc.y, -scene_.radius});
        return LeSample{{p}, frame_.n, flux()};
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f&, std::optional<CellId>) const override {
        if (is_black(irradiance_)) return std::nullopt;
        return LightSample{-frame_.n, INFINITY, irradiance_, 0};
    }

  private:
    Frame frame_;     // n is the way the light travels
    Rgb irradiance_;  // W/m² on a plane that faces the light
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_distant_light(const V3f& direction, const Rgb& irradiance,
                                          const SceneSphere& scene) {
    return std::make_unique<DistantLight>(direction, irradiance, scene);
}

}  // namespace lucerna
