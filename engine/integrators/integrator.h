// A method's settings → a session of one render → an estimator for each pass → radiance.
//
// An Integrator is a method with its settings, without state. begin() makes what all passes of one render
// share (an importance pre-pass, first radii); Session::pass() makes what one pass needs (photon maps, VPLs;
// the path tracer makes nothing) and gives an Estimator, which follows single paths from the eye, from any
// thread.
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
    // Follows a path from the eye and books on its account what it finds. The mean over samplers is what the
    // method converges to.
    virtual void follow(const EyePath& path, Sampler& sampler) const = 0;
};

// One render by one method. It outlives its estimators.
class Session {
  public:
    virtual ~Session() = default;
    // The estimator of pass `index`, a function of scene, settings, seed and index alone: whoever renders a
    // pass elsewhere makes the same. Its phases are told to `monitor`. Null if the monitor stopped it.
    virtual std::unique_ptr<const Estimator> pass(std::uint32_t index, Monitor& monitor,
                                                  PassStatistics& statistics) const = 0;
};

class Integrator {
  public:
    virtual ~Integrator() = default;
    // What the context holds outlives the session. Null if the monitor stopped it.
    virtual std::unique_ptr<const Session> begin(const RenderContext& context,
                                                 OnceStatistics& statistics) const = 0;
    // What a session would build for this scene, a line each; nothing for a method that only traces rays.
    virtual std::vector<std::string> describe(const Scene& /*scene*/) const { return {}; }
    // Whether its estimators look at EyePath::receiver.
    virtual bool takes_receivers() const { return false; }
    // Why this method cannot tell of the scene's light groups what each brings, and what could; empty: it
    // can.
    virtual std::string why_no_light_groups() const { return {}; }
    // Camera samples per pixel that one pass serves; 0: all there are, and pass 0 is the only one.
    virtual int samples_per_pass() const { return 0; }
};

// `files`: for the `photonmap` integrator alone.
std::unique_ptr<Integrator> make_integrator(const IntegratorSettings& settings, const MapFiles& files = {});

// One for each integrator's file.
std::unique_ptr<Integrator> make_path(const PathSettings& settings);
std::unique_ptr<Integrator> make_direct();
std::unique_ptr<Integrator> make_photon_mapping(const PhotonMapSettings& settings,
                                                const MapFiles& files = {});
std::unique_ptr<Integrator> make_igi(const IgiSettings& settings);
std::unique_ptr<Integrator> make_progressive(const ProgressiveSettings& settings);

// What a step of one pass may use, and where it tells what it did.
struct PassContext : RenderContext {
    std::uint32_t pass;
    PassStatistics& statistics;
};

// The session of a method that makes nothing beforehand: `make()` gives the estimator.
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
