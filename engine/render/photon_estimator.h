// What the camera sees by photon maps [Jensen 2001, 9; Goesele 2003, 5.2, 5.3].
//
// Every path of light is counted once. At a diffuse surface, what arrives is split by where it comes from:
//   straight from a light        lights sampled (plainly or by the Direct map), or the Direct map itself
//   over mirrors and glass only  the Caustic map
//   over a diffuse surface       final gather, or the Global map
// Scattering in a medium counts as a diffuse surface. What media scatter into a ray, be it the camera's or a
// gather ray, is split in the same way:
//   straight from a light        lights sampled, or the Volume map
//   all else                     the Volume map
// Gloss, rough metal and glass carry no photons: a ray that meets them asks the lights and goes on, as a path
// would. A surface that is both (paint under varnish) is shaded as both. What counts as a mirror is a
// setting: perfect ones alone, or gloss up to some alpha, whose caustics then come from the Caustic map.
#pragma once

#include <memory>
#include <optional>

#include "engine/render/integrator.h"
#include "engine/render/photon_mapping.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/guide.h"
#include "photon/irradiance.h"

namespace lucerna {

struct DensityEstimatePair {
    DensityEstimateSettings eye, gather;  // of estimates at what the camera sees, and where gather rays land
    float volume_radius = 1;              // the largest of an estimate in space
};

// What has been precomputed; the maps that are absent are not read.
struct PhotonEstimatorParts {
    PhotonMaps maps;
    std::optional<GuideMap> guides;              // for the direct methods that go by one
    std::optional<IrradiancePoints> irradiance;  // looked up by gather rays where they land
    std::unique_ptr<const RadiusRule> radii;     // null: radii by the photons that are estimated from
    std::vector<float> caustic_radii;            // with radii: by them, of each photon of the Caustic map
};

std::unique_ptr<const Estimator> make_photon_estimator(const Scene& scene, const PhotonMapSettings& settings,
                                                       const DensityEstimatePair& estimates,
                                                       PhotonEstimatorParts parts);

}  // namespace lucerna
