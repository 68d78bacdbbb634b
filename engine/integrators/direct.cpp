// Computes direct light alone, on surfaces and in media, and follows mirrors and smooth glass. The difference
// from the other methods' images is indirect light.
#include "engine/integrators/integrator.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/follow.h"

namespace lucerna {
namespace {

class DirectEstimator final : public Estimator {
  public:
    explicit DirectEstimator(const Scene& scene) : scene_(scene), lights_(scene) {}

    void follow(const EyePath& path, Sampler& sampler) const override {
        lucerna::follow(scene_, path, sampler, Visitor{{}, *this});
    }

  private:
    struct Visitor : EyeVisitor {
        const DirectEstimator& of;

        bool at_surface(EyePath& path, const Vertex& at, Sampler& sampler) const {
            const LightChoice choice = of.lights_.at(at.hit.at, at.bsdf, at.wo);
            return go_on(path, at, direct_light(of.scene_, at, sampler, choice, path), sampler);
        }
        bool at_medium(EyePath& path, const MediumVertex& at, const Rgb& sigma_s, Sampler& sampler) const {
            direct_light(of.scene_, at, sampler, of.lights_.at(at.p), path.times(sigma_s));
            return false;
        }
    };

    const Scene& scene_;
    LightChooser lights_;
};

class DirectIntegrator final : public Integrator {
  public:
    std::unique_ptr<const Session> begin(const RenderContext& context,
                                         OnceStatistics& /*statistics*/) const override {
        return session_without_state(
            [&scene = context.scene] { return std::make_unique<DirectEstimator>(scene); });
    }
};

}  // namespace

std::unique_ptr<Integrator> make_direct() {
    return std::make_unique<DirectIntegrator>();
}

}  // namespace lucerna
