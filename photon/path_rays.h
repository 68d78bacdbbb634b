// The rays of a photon pass, for measuring: what the pass asks of the scene, without what it makes of it.
#pragma once

#include <vector>

#include "photon/build_maps.h"

namespace lucerna {

// Every ray that build_photon_maps traces for the parameters' `paths` (targets are not looked at), in the
// order in which one thread traces them. Only for scenes without borders between media, whose search for the
// medium around a vertex traces others.
std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapParameters& parameters);

}  // namespace lucerna
