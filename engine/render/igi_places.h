// Where a picture is shaded by virtual lights: a few places that the camera sees, and what virtual lights
// bring there. What a pilot weighs light paths by (igi_pilot.h), and virtual lights (igi_thinning.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/render/igi_shade.h"
#include "engine/render/integrator.h"
#include "photon/virtual_lights.h"

namespace lucerna {

// Where the picture is shaded by virtual lights.
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

// What a virtual light brings to the camera ray of a place, luminance, as the image has it of a set of one
// path.
class PlaceShading {
  public:
    PlaceShading(const Scene& scene, const IgiSettings& settings);

    float radiance(const SeenPlace& place, const VirtualLight& light, Stream& stream) const {
        const float result =
            luminance(shading_.shade(place.vertex(), light, place.throughput * scale_, stream));
        return std::isfinite(result) ? result : 0.0F;
    }

  private:
    VirtualLightShading shading_;
    float scale_;  // of indirect light
};

}  // namespace lucerna
