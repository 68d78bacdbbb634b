// A sky of constant radiance. A particle's line is uniform among the lines that meet the scene's sphere: any
// direction, and any point of the disc of radius R across it. Lines' measure is 4π · πR², hence the flux
// 4π²R² L.
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"

namespace lucerna {
namespace {

class InfiniteLight final : public Light {
  public:
    InfiniteLight(const Rgb& radiance, const SceneSphere& scene) : radiance_(radiance), scene_(scene) {}

    std::string_view kind() const override { return "infinite"; }
    bool has_impostor() const override { return true; }
    Rgb flux() const override { return radiance_ * (4 * kPi * kPi * sqr(scene_.radius)); }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        if (is_black(radiance_)) return std::nullopt;
        const Frame frame(square_to_sphere(u.direction).normalized());
        const V2f disc = scene_.radius * square_to_disc(u.position);
        const V3f p = scene_.centre + frame.to_world({disc.x, disc.y, -scene_.radius});
        return LeSample{{p}, frame.n, flux()};
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f& u, std::optional<CellId>) const override {
        if (is_black(radiance_)) return std::nullopt;
        return LightSample{square_to_sphere(u).normalized(), INFINITY, radiance_ * (4 * kPi), kSpherePdfW};
    }

    // A ray with an end does not reach the sky.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (ray.t_max < INFINITY) return std::nullopt;
        return EmittedRadiance{radiance_, kSpherePdfW, INFINITY};
    }

  private:
    Rgb radiance_;  // W/(m² sr)
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_infinite_light(const Rgb& radiance, const SceneSphere& scene) {
    return std::make_unique<InfiniteLight>(radiance, scene);
}

}  // namespace lucerna
