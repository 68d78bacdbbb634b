// A method's settings → a session of one render → an estimator for each pass → radiance.
//
// An Integrator is a method with its settings, without state. begin() makes what all passes of one render
// share (an importance pre-pass, first radii); Session::pass() makes what one pass needs (photon maps, VPLs;
// the path tracer makes nothing) and gives an Estimator, which answers for single camera rays, from any
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
#include "engine/transport/direct_light.h"
#include "photon/build_maps.h"

namespace lucerna {

// The ray of a camera sample.
struct CameraRay {
    Ray ray;
    V2f film{0, 0};  // place on the whole film, pixels: a method may take more or fewer samples there than
                     // elsewhere
    // Of the image's samples, 0 or 1, where these are to be independent of each other: what a method makes
    // several of, it may use for one half alone. None: all is for all samples.
    std::optional<int> half = {};
    // Gets what the sample's radiance is made of, black before; null: nobody asks. The radiance is the same,
    // bit for bit, with and without.
    LightParts* parts = nullptr;
    // Gets what density estimates at what the camera sees differ by from sharper ones
    // (DensityEstimateResult), as it reaches the eye, added to what is there; null: nobody asks. The radiance
    // is the same.
    Rgb* blur = nullptr;
    // In the place of the first surface along the ray, which is then along its normal: of a point of a
    // calculation surface (engine/scene/receiver.h), by methods with illuminance for their quantity. Null:
    // what the ray meets.
    const Hit* receiver = nullptr;
    // The medium of the borders in which the ray begins, by the same methods; none: that of the scene's
    // camera.
    std::optional<std::int32_t> medium = {};
    // Lamps whose emission the sample does not count where the ray itself meets them; null: none.
    const LampSet* but = nullptr;

    EmissionRule rule() const { return EmissionRule::all_but(but); }
};

class Estimator {
  public:
    virtual ~Estimator() = default;
    // Radiance that arrives along a camera ray, W/(m² sr). Its mean over samplers is what the method
    // converges to.
    virtual Rgb Li(const Ray& ray, Sampler& sampler) const = 0;
    // The same for the ray of a camera sample, whose place and half may matter.
    virtual Rgb Li_of(const CameraRay& camera, Sampler& sampler) const { return Li(camera.ray, sampler); }
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
    // Whether its estimators look at CameraRay::receiver.
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
std::unique_ptr<Integrator> make_direct(const DirectSettings& settings);
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
