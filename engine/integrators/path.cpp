// The path tracer: unbiased, with next-event estimation and MIS at every vertex. The judge of everything
// else.
#include "engine/integrators/direct_light.h"
#include "engine/integrators/path_estimators.h"
#include "photon/light_path.h"

namespace lucerna {
namespace {

class PathEstimator final : public Estimator {
  public:
    PathEstimator(const Scene& scene, const PathSettings& settings)
        : scene_(scene), settings_(settings), lights_(scene, settings.lights) {}

    Rgb Li(const Ray& camera_ray, Sampler& sampler) const override {
        Rgb result(0);
        Rgb throughput(1);
        float eta_scale = 1;  // radiance compression inside glass says nothing about how much a path carries
        Ray ray = camera_ray;
        EmissionRule rule = EmissionRule::all();
        const bool meter = settings_.quantity == Quantity::illuminance;

        for (int bounce = 0; bounce < static_cast<int>(kMaxBounces); ++bounce) {
            const auto hit = scene_.intersect(ray);
            const bool metered = meter && bounce == 0;
            if (!metered) result += throughput * emission(scene_, ray, hit, rule);
            if (!hit || (settings_.max_depth > 0 && bounce >= settings_.max_depth)) break;

            // Ask the lights.
            const Bsdf bsdf = metered ? white_receiver(*hit) : scene_.bsdf(*hit);
            const V3f wo = -ray.d;
            const bool specular = bsdf.is_delta();
            const LightChoice choice = specular ? LightChoice() : lights_.at(hit->at, bsdf, wo);
            if (!specular) result += throughput * next_event(scene_, {*hit, bsdf, wo}, sampler, choice);

            // Go on.
            const BsdfU u{sampler.next(), sampler.next2()};
            const float u_survive = sampler.next();
            const auto sample = bsdf.sample(wo, u, Transport::radiance);
            if (!sample) break;
            throughput *= sample->weight;
            eta_scale *= sample->eta_scale;
            rule = sample->delta ? EmissionRule::all() : EmissionRule::mis(sample->pdf_w, choice);
            ray = Ray{hit->at.towards(sample->wi), sample->wi};

            // Russian roulette by the throughput that is left.
            if (bounce + 1 < kRouletteFrom) continue;
            const float survival = std::min(kMaxSurvival, max_component(throughput) / eta_scale);
            if (!(u_survive < survival)) break;  // also when the throughput is black: survival is 0
            throughput /= survival;
        }
        return meter ? meter_reading(result) : result;
    }

  private:
    const Scene& scene_;
    PathSettings settings_;
    LightChooser lights_;
};

class PathIntegrator final : public Integrator {
  public:
    explicit PathIntegrator(const PathSettings& settings) : settings_(settings) {}
    std::unique_ptr<const Estimator> prepare(const PassContext& context) const override {
        if (!context.scene.media().empty()) return make_media_path(context.scene, settings_);
        return std::make_unique<PathEstimator>(context.scene, settings_);
    }

  private:
    PathSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_path(const PathSettings& settings) {
    return std::make_unique<PathIntegrator>(settings);
}

}  // namespace lucerna
