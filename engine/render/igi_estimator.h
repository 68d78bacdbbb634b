// What is seen by instant global illumination, once its virtual lights stand [igi 3]. A set lights surfaces,
// and the places along a ray at which media scatter.
#pragma once

#include <memory>

#include "engine/render/integrator.h"
#include "photon/virtual_lights.h"

namespace lucerna {

// `paths`: light paths of each set. The scene outlives the estimator.
std::unique_ptr<const Estimator> make_igi_estimator(const Scene& scene, const IgiSettings& settings,
                                                    VirtualLightSets sets, std::uint32_t paths);

}  // namespace lucerna
