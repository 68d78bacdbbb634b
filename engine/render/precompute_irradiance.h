// Precomputed irradiance for final gather: what IrradiancePoints add up, direct light included.
#pragma once

#include "engine/render/integrator.h"
#include "photon/build_maps.h"
#include "photon/irradiance.h"

namespace lucerna {

// Whether the points hold direct light, too, so that a gather ray asks nothing more where it lands. Sampled
// beforehand it is not where there are media: the points do not know in which they lie.
inline bool holds_direct(const PhotonMapSettings& settings, const Scene& scene) {
    return settings.direct == DirectMethod::map || (settings.precompute_lights > 0 && scene.media().empty());
}

// A point for one photon in n of the Global map (settings.precompute > 0), with the light of all maps;
// direct light by the Direct map, or sampled as `settings.precompute_lights` says.
IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how, const PhotonMapSettings& settings);

}  // namespace lucerna
