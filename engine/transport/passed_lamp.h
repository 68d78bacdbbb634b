// Samples the light that a medium scatters into a ray close to a lamp.
//
// A path that samples distances by transmittance seldom stops close to a lamp, but is brighter there by the
// inverse square of the distance: a heavy tail that a few samples cannot estimate. The direct light at places
// on the ray is therefore split into two shares. One is estimated at a place drawn evenly by the angle at
// which the lamp sees it (equiangular sampling [Kulla and Fajardo 2012]), so that the inverse square cancels;
// the other is estimated where the path stops. Both shares are functions of the place alone and add up to 1,
// and so are unbiased in any medium. They follow the power heuristic for both strategies' densities without
// transmittance, which is not known where media vary.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/scene.h"
#include "engine/transport/eye_path.h"
#include "engine/transport/light_choice.h"
#include "lights/light_bounds.h"

namespace lucerna {

// Represents a lamp beside the ray from 0 to `end` (scene units), which may be infinite.
class PassedLamp {
  public:
    PassedLamp(const Ray& ray, double end, const LightBounds& lamp);

    // Returns a distance along the ray, evenly distributed by angle. u in [0,1).
    double draw(float u) const;
    // Returns the density of draw() at t, per scene unit; > 0.
    double pdf(double t) const;
    // Returns the share of direct light at t that draw() estimates, with scattering coefficient `sigma_s`.
    float share(double t, const Rgb& sigma_s) const;
    // Returns the remaining share, to be estimated where a path is scattered at t.
    float share_left(double t, const Scene& scene, const MediumVertex& at) const {
        return 1 - share(t, scattering_at(scene.media(), at.medium, at.p));
    }

  private:
    double nearest_;       // distance along the ray at which it is nearest to the lamp's centre
    double aside_;         // distance between that place and the centre, at least the lamp's radius; > 0
    double from_, angle_;  // angle of the ray's origin, and the angle from there to its end [rad]
};

// Returns a lamp that shines on a random place of the ray, as chosen by `lights`. Returns none if no light
// shines there, or one without bounds. Draws two 1D numbers and one 2D number from `sampler`.
std::optional<PassedLamp> passed_lamp(const Scene& scene, const LightChooser& lights, const Ray& ray,
                                      double end, Sampler& sampler);

// Draws a place beside the lamp that a piece of the path's ray passes, and books its share of direct light.
// `hit` ends the whole ray. Returns the lamp, or none if there is none, and then books nothing.
std::optional<PassedLamp> add_light_beside_lamp(const Scene& scene, const LightChooser& lights,
                                                const PathAccount& path, const MediumPiece& piece,
                                                const std::optional<Hit>& hit, Sampler& sampler);

}  // namespace lucerna
