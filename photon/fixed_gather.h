// Radiance from a photon map within a radius that is given, not found: what progressive passes look with.
#pragma once

#include "photon/gather.h"

namespace lucerna {

// All photons of the map within `radius` by the tangent metric count; for a density that is linear in the
// disc the estimate is unbiased. Of the settings the ratio, the kernel and the metric matter. `radius` is
// raised to the surface's own error, below which float32 cannot tell points apart. Photons are summed in the
// order of the map's tree, which is a function of the photons alone.
GatherResult gather_within(const PhotonMap& map, const GatherSettings& settings, float radius, const Hit& hit,
                           const Bsdf& bsdf, const V3f& wo);

}  // namespace lucerna
