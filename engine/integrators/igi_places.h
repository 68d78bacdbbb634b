// Where a picture is shaded by VPLs: a few places that the camera sees, and what VPLs bring there. What a
// pre-pass weighs light paths by (igi_pre_pass.h), and VPLs (igi_thinning.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/integrators/integrator.h"
#include "engine/vpl/vpl.h"
#include "engine/vpl/vpl_shading.h"

namespace lucerna {

// Where the picture is shaded by VPLs.
struct SeenPlace {
    Hit hit;
    Bsdf bsdf;
    V3f wo;
    std::int32_t medium;
    Rgb throughput;  // to the film
    std::uint32_t ray;

    Vertex vertex() const { return {hit, bsdf, wo, medium}; }
};

struct SeenPlaces {
    std::vector<SeenPlace> places;
    std::vector<float> shown;  // by camera ray: luminance
};

// Rays evenly over the film; `shown` is emission and direct light. Requires a view and media that do not
// scatter. The same for any number of threads.
SeenPlaces see_places(const IgiSettings& settings, const PassContext& context, std::int64_t rays);

// What a VPL brings to the camera ray of a place, luminance, as the image has it of a set of one path.
class PlaceShading {
  public:
    PlaceShading(const Scene& scene, const IgiSettings& settings);

    float radiance(const SeenPlace& place, const Vpl& light, Sampler& sampler) const {
        const float result =
            luminance(shading_.shade(place.vertex(), light, place.throughput * scale_, sampler));
        return std::isfinite(result) ? result : 0.0F;
    }

  private:
    VplShading shading_;
    float scale_;  // of indirect light
};

}  // namespace lucerna
