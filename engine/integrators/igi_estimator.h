// What is seen by instant global illumination, once its VPLs stand [Pharr 2004]. A set lights surfaces, and
// the places along a ray at which media scatter.
#pragma once

#include <memory>
#include <optional>

#include "engine/guiding/guide.h"
#include "engine/integrators/igi_caustics.h"
#include "engine/integrators/integrator.h"
#include "engine/vpl/igi_vpls.h"

namespace lucerna {

// The settings with a distance in place of "the default".
IgiSettings with_distance(const Scene& scene, IgiSettings settings);

// `settings` are those of the lights. `guides`: by which surfaces ask lights; none: as the settings say. The
// scene outlives the estimator.
std::unique_ptr<const Estimator> make_igi_estimator(const Scene& scene, const IgiSettings& settings,
                                                    IgiVpls lights, IgiCaustics caustics,
                                                    std::optional<GuideMap> guides = {});

}  // namespace lucerna
