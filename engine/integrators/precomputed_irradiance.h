// Precomputes irradiance for the final gather [Christensen 1999]: gather rays look it up where they land
// instead of estimating density. photon/irradiance.h holds the points; this file computes the light that they
// are given.
#pragma once

#include "engine/integrators/integrator.h"
#include "engine/integrators/settings.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"

namespace lucerna {

// Tells whether the points hold direct light, too, so that nothing is left to find where a gather ray lands.
// In scenes with media direct light is not sampled in advance, because the points do not store their medium.
bool holds_direct(const PhotonMapSettings& settings, const Scene& scene);

// Makes an irradiance point for one photon in n of the Global map, with the light of all maps of surfaces.
// Direct light is sampled, or, with direct = map, read from the Direct map. Requires these maps and a
// positive settings.precompute.
IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how, const PhotonMapSettings& settings);

}  // namespace lucerna
