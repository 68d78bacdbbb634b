// A method's first pass over a scene, without a camera unless a view is given.
#pragma once

#include <memory>

#include "engine/integrators/integrator.h"

namespace lucerna::testing {

class OnePass {
  public:
    OnePass(const Integrator& integrator, const RenderContext& context) : scene_(context.scene) {
        OnceStatistics once;
        PassStatistics statistics;
        session_ = integrator.begin(context, once);
        if (session_) estimator_ = session_->pass(0, context.monitor, statistics);
    }
    OnePass(const IntegratorSettings& settings, const RenderContext& context)
        : OnePass(*make_integrator(settings), context) {
        quantity_ = quantity_of(settings);
        max_depth_ = max_depth_of(settings);
    }

    // Returns the value that the image shows along a camera ray.
    Rgb Li(const Ray& ray, Sampler& sampler) const {
        SampleAccount account;
        estimator_->follow(EyePath::begin(scene_, ray, quantity_, max_depth_, account), sampler);
        return account.radiance();
    }
    const Estimator& operator*() const { return *estimator_; }

  private:
    const Scene& scene_;
    Quantity quantity_ = Quantity::radiance;
    int max_depth_ = 0;
    std::unique_ptr<const Session> session_;
    std::unique_ptr<const Estimator> estimator_;
};

}  // namespace lucerna::testing
