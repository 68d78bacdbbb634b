// An image as a sky. A particle's direction is drawn from the image, and its line is uniform across the disc
// of the scene's sphere perpendicular to that direction. The disc's area is πR², so the flux is πR² ∫ L dω.
#include <cmath>

#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "lights/analytic.h"
#include "lights/image_lights.h"

namespace lucerna {
namespace {

class ImageInfiniteLight final : public Light {
  public:
    ImageInfiniteLight(std::shared_ptr<const DirectionalImage> image, const LightAxes& axes, const Rgb& scale,
                       const SceneSphere& scene, FluxUnit unit)
        : Light(unit), image_(std::move(image)), axes_(axes), scale_(scale), scene_(scene) {}

    std::string_view kind() const override { return "infinite"; }
    bool is_at_infinity() const override { return true; }
    bool has_impostor() const override { return true; }
    Rgb flux() const override { return scale_ * image_->integral() * disc_area(); }
    std::optional<double> sky_irradiance() const override {
        return double{luminance(scale_ * image_->irradiance())};
    }

    std::optional<LeSample> sample_Le(const LeSampleU& u) const override {
        const auto drawn = image_->draw(u.direction);
        if (!drawn) return std::nullopt;
        const Rgb weight = scale_ * drawn->value * (disc_area() / drawn->pdf_w);
        if (is_black(weight) || !is_finite(weight)) return std::nullopt;
        const Frame frame(-axes_.to_world(drawn->w).normalized());
        return particle_from_afar(scene_, frame, u.position, weight);
    }

    std::optional<LightSample> sample_Li(const V3f&, const V2f& u, std::optional<CellId>) const override {
        const auto drawn = image_->draw(u);
        if (!drawn) return std::nullopt;
        const Rgb weight = scale_ * drawn->value / drawn->pdf_w;
        if (is_black(weight) || !is_finite(weight)) return std::nullopt;
        return LightSample{axes_.to_world(drawn->w).normalized(), INFINITY, weight, drawn->pdf_w};
    }

    // Rays with a finite end do not reach the sky.
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (ray.t_max < INFINITY) return std::nullopt;
        const V3f w = axes_.to_local(ray.d);
        return EmittedRadiance{scale_ * image_->at(w), image_->pdf_w(w), INFINITY};
    }

  private:
    float disc_area() const { return kPi * sqr(scene_.radius); }

    std::shared_ptr<const DirectionalImage> image_;
    LightAxes axes_;
    Rgb scale_;
    SceneSphere scene_;
};

}  // namespace

std::unique_ptr<Light> make_image_infinite_light(std::shared_ptr<const DirectionalImage> image,
                                                 const LightAxes& axes, const Rgb& scale,
                                                 const SceneSphere& scene, FluxUnit unit) {
    return std::make_unique<ImageInfiniteLight>(std::move(image), axes, scale, scene, unit);
}

}  // namespace lucerna
