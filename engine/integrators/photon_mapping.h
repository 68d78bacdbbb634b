// Photon mapping as a part of other methods: the maps of one pass and what the camera sees by them.
#pragma once

#include <memory>

#include "engine/integrators/integrator.h"
#include "photon/build_maps.h"
#include "photon/density_estimate.h"
#include "photon/irradiance.h"

namespace lucerna {

// The radius of an estimate where it does not follow from the photons that are estimated from.
class RadiusRule {
  public:
    virtual ~RadiusRule() = default;
    // Scene units, > 0. n: unit, on the side that is seen.
    virtual float radius(MapKind map, const V3f& x, const V3f& n) const = 0;
    // In space, for the Volume map.
    virtual float volume_radius() const = 0;
};

// What the `photonmap` integrator with these settings prepares; with `radii`, all photons within them count
// in place of the k nearest; with `emission`, which is used while maps are made, paths are emitted by that.
// Null if the monitor stopped it.
std::unique_ptr<const Estimator> prepare_photon_maps(const PhotonMapSettings& settings,
                                                     const PassContext& context,
                                                     std::unique_ptr<const RadiusRule> radii,
                                                     const LearnedEmission* emission = nullptr);

// Precomputed irradiance for final gather: a point for one photon in n of the Global map (settings.precompute
// > 0), with the light of all maps; direct light by the Direct map, or sampled as
// `settings.precompute_lights` says.
IrradiancePoints precompute_irradiance(const PassContext& context, const PhotonMaps& maps,
                                       const DensityEstimateSettings& how, const PhotonMapSettings& settings);

}  // namespace lucerna
