// The keystone: recipe → prepared pass → radiance.
//
// An Integrator is a recipe without state. prepare() does what a pass needs once (build photon maps, VPLs;
// the path tracer does nothing) and gives an Estimator, which answers for single camera rays, from any
// thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/guiding/importons.h"
#include "engine/integrators/render_report.h"
#include "engine/integrators/settings.h"
#include "engine/scene/scene.h"
#include "photon/map_file.h"

namespace lucerna {

class Estimator {
  public:
    virtual ~Estimator() = default;
    // Radiance that arrives along a camera ray, W/(m² sr). Its mean over samplers is what the method
    // converges to.
    virtual Rgb Li(const Ray& ray, Sampler& sampler) const = 0;
};

// What all passes of a method share and none of them changes. A function of scene and seed alone: whoever
// renders a pass elsewhere makes the same.
class SharedState {
  public:
    virtual ~SharedState() = default;
};

// What prepare() may use. The scene and the shared state outlive the estimator.
struct PassContext {
    const Scene& scene;
    std::uint64_t seed;
    std::uint32_t pass;
    const Workers& workers;
    Monitor& monitor;
    RenderReport& report;
    const SharedState* shared_state = nullptr;  // what shared_state() gave
    const MapFiles* map_files = nullptr;
    std::optional<View> view = {};  // what the image shows; maps may be built for it alone
};

class Integrator {
  public:
    virtual ~Integrator() = default;
    // Null if the monitor stopped it.
    virtual std::unique_ptr<const Estimator> prepare(const PassContext& context) const = 0;
    // What prepare() would build for this scene, a line each; nothing for a method that only traces rays.
    virtual std::vector<std::string> describe(const Scene& /*scene*/) const { return {}; }
    // Camera samples per pixel that one prepared pass serves; 0: all there are.
    virtual int samples_per_pass() const { return 0; }
    // Made once, before the first pass (context.shared_state is null). Null if there is none or the monitor
    // stopped it.
    virtual std::unique_ptr<const SharedState> shared_state(const PassContext& /*context*/) const {
        return nullptr;
    }
};

std::unique_ptr<Integrator> make_integrator(const IntegratorSettings& settings);

// One for each integrator's file.
std::unique_ptr<Integrator> make_path(const PathSettings& settings);
std::unique_ptr<Integrator> make_direct(const DirectSettings& settings);
std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings);
std::unique_ptr<Integrator> make_igi(const IgiSettings& settings);
std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings);

}  // namespace lucerna
