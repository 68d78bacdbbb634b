// The daylight factor: the illuminance at a point by the light of the sky, direct or over surfaces, divided
// by that of an unobstructed horizontal plane under the same sky. By definition the sun is left out [CIE S
// 017:2020].
#pragma once

#include "engine/photometry/illuminance.h"

namespace lucerna {

// Returns the illuminance of an unobstructed horizontal plane under the scene's sky, in the scene's unit.
// Throws InputError unless the scene's only light is one sky that shines; its sun is left out by
// SceneOverrides::without_sun.
double sky_illuminance(const Scene& scene);

// Returns the report with all illuminances in per cent of `sky_illuminance` > 0.
IlluminanceReport daylight_factors(IlluminanceReport report, double sky_illuminance);

}  // namespace lucerna
