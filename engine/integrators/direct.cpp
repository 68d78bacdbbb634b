// Direct light alone, on surfaces and in media; mirrors and smooth glass are followed. What the other methods
// add is what this lacks.
#include "engine/integrators/integrator.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/specular_chain.h"

namespace lucerna {
namespace {

class DirectEstimator final : public Estimator {
  public:
    DirectEstimator(const Scene& scene, const DirectSettings& settings)
        : scene_(scene), settings_(settings), lights_(scene, settings.lights) {}

    Rgb Li(const Ray& ray, Sampler& sampler) const override { return Li_of(CameraRay{ray}, sampler); }
    Rgb Li_of(const CameraRay& camera, Sampler& sampler) const override {
        const Ray& ray = camera.ray;
        const PartsSink of_ray(camera.parts);
        const auto shade = [&](const Vertex& vertex, int /*left*/, const PartsSink& parts) {
            return direct_light(scene_, vertex, sampler, lights_.at(vertex.hit.at, vertex.bsdf, vertex.wo),
                                parts);
        };
        const int most = most_bounces(settings_.max_depth);
        if (settings_.quantity == Quantity::illuminance)
            return meter_and_shade(scene_, ray, most, shade, of_ray);
        const auto source = [&](const MediumVertex& vertex, const Rgb& sigma_s, int /*left*/,
                                const PartsSink& parts) {
            return sigma_s *
                   direct_light(scene_, vertex, sampler, lights_.at(vertex.p), parts.times(sigma_s));
        };
        return follow_and_shade(scene_, from_camera(scene_, ray, camera.rule(), most), sampler, shade, source,
                                of_ray);
    }

  private:
    const Scene& scene_;
    DirectSettings settings_;
    LightChooser lights_;
};

class DirectIntegrator final : public Integrator {
  public:
    explicit DirectIntegrator(const DirectSettings& settings) : settings_(settings) {}
    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& /*statistics*/) const override {
        return session_without_state([&scene = context.scene, settings = settings_] {
            return std::make_unique<DirectEstimator>(scene, settings);
        });
    }

  private:
    DirectSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_direct(const DirectSettings& settings) {
    return std::make_unique<DirectIntegrator>(settings);
}

}  // namespace lucerna
