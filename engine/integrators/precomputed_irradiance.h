// Precomputed irradiance for final gather [Christensen 1999]: gather rays look it up where they land, in
// place of an estimate of each. The points themselves are photon/irradiance.h; here is the light that they
// are given.
#pragma once

#include "engine/integrators/integrator.h"
#include "engine/integrators/settings.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"

namespace lucerna {

// Whether the points hold direct light, too, so that nothing is left to find where a gather ray lands. In
// scenes with media direct light is not sampled in advance: the points do not store their medium.
bool holds_direct(const PhotonMapSettings& settings, const Scene& scene);

// Makes a point for one photon in n of the Global map, which must be there
// (settings.precompute > 0; with direct = map the Direct map, too), with the light of all maps; direct light
// by the Direct map, or sampled.
IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how, const PhotonMapSettings& settings);

}  // namespace lucerna
