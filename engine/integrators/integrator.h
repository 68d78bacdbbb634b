// Defines the interface of the rendering methods: Integrator → Session → Estimator → radiance.
//
// An Integrator is a method with its settings, without state. begin() starts one render and makes what all of
// its passes share (an importance pre-pass, first radii). Session::pass() makes what one pass needs (photon
// maps, VPLs; nothing for the path tracer) and returns an Estimator, which follows single paths from the eye,
// from any thread.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/integrators/settings.h"
#include "engine/integrators/statistics.h"
#include "engine/scene/render_context.h"
#include "engine/transport/eye_path.h"
#include "photon/build_maps.h"

namespace lucerna {

class Estimator {
  public:
    virtual ~Estimator() = default;
    // Follows a path from the eye and books the light that it finds on the path's account. The mean over
    // samplers is the value to which the method converges.
    virtual void follow(const EyePath& path, Sampler& sampler) const = 0;
};

// Represents one render by one method. A session outlives its estimators.
class Session {
  public:
    virtual ~Session() = default;
    // Returns the estimator of pass `index`, a function of scene, settings, seed and index alone: every
    // process makes the same one. Reports phases to `monitor`. Returns null if the monitor stopped it.
    virtual std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                                  PassStatistics& statistics) const = 0;
};

class Integrator {
  public:
    virtual ~Integrator() = default;
    // Begins a render. The context's references outlive the session. Returns null if the monitor stopped it.
    virtual std::unique_ptr<const Session> begin(const RenderContext& context,
                                                 OnceStatistics& statistics) const = 0;
    // Returns a line for each structure that a session would build; empty for a method that only traces rays.
    virtual std::vector<std::string> describe(const Scene& /*scene*/) const { return {}; }
    // Tells whether the estimators use EyePath::receiver.
    virtual bool takes_receivers() const { return false; }
    // Returns why this method cannot separate the scene's light groups, and which ones can; empty if it can.
    virtual std::string why_no_light_groups() const { return {}; }
    // Returns the number of camera samples per pixel that one pass serves; 0 if pass 0 serves them all.
    virtual int samples_per_pass() const { return 0; }
};

// Only the `photonmap` integrator uses `files`.
std::unique_ptr<Integrator> make_integrator(const IntegratorSettings& settings, const MapFiles& files = {});

// Each of these is defined in its integrator's own file.
std::unique_ptr<Integrator> make_path(const PathSettings& settings);
std::unique_ptr<Integrator> make_direct();
std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings,
                                                const MapFiles& files = {});
std::unique_ptr<Integrator> make_igi(const IgiSettings& settings);
std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings);

// Adds the index of the pass to the context, and the place where its steps record their statistics.
struct PassContext : RenderContext {
    std::uint32_t pass;
    PassStatistics& statistics;
};

// Returns the session of a method that prepares nothing. make() returns the estimator of a pass.
template <typename Make>
std::unique_ptr<const Session> session_without_state(Make make) {
    struct Stateless final : Session {
        explicit Stateless(Make m) : make_(std::move(m)) {}
        std::unique_ptr<const Estimator> pass(std::uint32_t /*index*/, Monitor& /*monitor*/,
                                              PassStatistics& /*statistics*/) const override {
            return make_();
        }
        Make make_;
    };
    return std::make_unique<Stateless>(std::move(make));
}

}  // namespace lucerna
