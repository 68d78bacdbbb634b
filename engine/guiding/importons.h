// Where the picture reads its photon maps: camera rays, followed to the surfaces on which photons rest.
//
// An importon stands for one such look: a place, the side that is looked at, and how much of the radiance
// there reaches the film. Camera rays pass mirrors, glass and gloss, one way at each, to the first surfaces
// that store photons; where indirect light is by final gather, one diffuse bounce leads on to where a gather
// ray lands.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/scene/camera.h"
#include "engine/scene/scene.h"

namespace lucerna {

// What the film shows of the scene.
struct View {
    const Camera* camera;  // not null
    V2f begin, end;        // the part of the film that is rendered, pixels, begin < end
};

struct Importon {
    V3f p;
    V3f n;              // unit, on the side that is looked at
    float weight;       // of the irradiance there in its ray's radiance, > 0
    std::uint32_t ray;  // the camera ray
    bool landed;        // a gather ray did; else the camera looks at it
};

struct ImportonParameters {
    std::int64_t rays = 16384;  // camera rays, evenly over the film
    bool gather = false;        // whether gather rays are followed
    bool meter = false;         // the image shows illuminance: the first surface is a white one
    std::uint64_t seed = 0;
};

// In the order of the rays; the same for any number of threads.
std::vector<Importon> trace_importons(const Scene& scene, const View& view,
                                      const ImportonParameters& parameters, const Workers& workers);

}  // namespace lucerna
