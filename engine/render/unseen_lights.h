// Lights that only particles carry, media that glow, and methods that do not look for them there.
#pragma once

#include "engine/base/monitor.h"
#include "engine/integrators/settings.h"
#include "engine/scene/scene.h"

namespace lucerna {

// One warning if some light's direct light, or all of its light, will be missing from the picture.
void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

// One warning if media glow and the method does not look for that.
void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

}  // namespace lucerna
