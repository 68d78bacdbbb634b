// Light that a medium scatters into a way close to a lamp.
//
// A path that draws its distances by what the medium lets pass seldom stops close to a lamp, and is brighter
// by the inverse square of the distance where it does: a heavy tail, of which a few samples tell nothing. So
// the direct light at places on the way is split into two shares. One is estimated at a place that is drawn
// evenly by the angle under which the lamp sees it [Kulla and Fajardo 2012], so that the inverse square of
// the distance cancels; the other where the path stops. Both shares are functions of the place alone, add up
// to 1, and so are unbiased in any medium. They follow the power heuristic for the densities of both
// strategies, but for the transmittance, which is not known where media vary.
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

// A lamp beside the ray from 0 to `end`, which may be infinite (scene units).
class PassedLamp {
  public:
    PassedLamp(const Ray& ray, double end, const LightBounds& lamp);

    // A distance along the ray, evenly distributed by angle; u in [0,1).
    double draw(float u) const;
    // Its density per scene unit; > 0.
    double pdf(double t) const;
    // The share of direct light at t that the drawn place estimates, where media scatter `sigma_s` there.
    float share(double t, const Rgb& sigma_s) const;
    // The rest, which is to be found where a path is scattered at t.
    float share_left(double t, const Scene& scene, const MediumVertex& at) const {
        return 1 - share(t, scattering_at(scene.media(), at.medium, at.p));
    }

  private:
    double nearest_;       // along the ray, of the lamp's middle
    double aside_;         // the distance from there, not less than the lamp is wide; > 0
    double from_, angle_;  // of the ray's beginning, and from there to its end [rad]
};

// The lamp that shines on a random place of the ray, as `lights` choose it. None: no light shines there, or
// one that has no place. Takes three numbers from `sampler`.
std::optional<PassedLamp> passed_lamp(const Scene& scene, const LightChooser& lights, const Ray& ray,
                                      double end, Sampler& sampler);

// Draws a place beside the lamp that a piece of the path's way passes, and books the share of direct light
// that it estimates. `hit` ends the whole way. None: there is no such lamp, and nothing is booked.
std::optional<PassedLamp> add_light_beside_lamp(const Scene& scene, const LightChooser& lights,
                                                const PathAccount& path, const MediumPiece& piece,
                                                const std::optional<Hit>& hit, Sampler& sampler);

}  // namespace lucerna
