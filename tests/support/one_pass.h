// A method's first pass of a scene, without a camera unless a view is given.
#pragma once

#include <memory>

#include "engine/integrators/integrator.h"

namespace lucerna::testing {

class OnePass {
  public:
    OnePass(const Integrator& integrator, const RenderContext& context) {
        OnceStatistics once;
        PassStatistics statistics;
        session_ = integrator.begin(context, once);
        if (session_) estimator_ = session_->pass(0, context.monitor, statistics);
    }
    OnePass(const IntegratorSettings& settings, const RenderContext& context)
        : OnePass(*make_integrator(settings), context) {}

    const Estimator& operator*() const { return *estimator_; }
    const Estimator* operator->() const { return estimator_.get(); }

  private:
    std::unique_ptr<const Session> session_;
    std::unique_ptr<const Estimator> estimator_;
};

}  // namespace lucerna::testing
