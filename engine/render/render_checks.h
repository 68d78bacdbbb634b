// Checks a render before it begins: its method, its memory, and light that its image will lack.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/integrators/settings.h"
#include "engine/render/render.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Throws InputError if the job's method cannot use the requested files of maps or cannot measure the
// requested receivers.
void require_fitting_method(const Job& job, const RenderOptions& options);

// Returns the peak memory of an image, in bytes: the film's sums, the image that is developed from them and,
// for each of saving and resuming checkpoints, the sums once more. It excludes the scene and the method's
// maps.
std::uint64_t image_memory(const Job& job, const RenderOptions& options);

// Throws InputError if there is less memory than that.
void require_image_memory(const Job& job, const RenderOptions& options);

// Warns if the method misses the direct light, or all light, of a lamp that only particles carry.
void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

// Warns if media emit light and the method does not include it.
void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

}  // namespace lucerna
