// Checks a render before it begins: its method, its memory, and light that the picture will lack.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/integrators/settings.h"
#include "engine/render/render.h"
#include "engine/scene/scene.h"

namespace lucerna {

// Throws InputError if the job's method can neither use the files of maps nor measure the receivers that are
// asked for.
void require_fitting_method(const Job& job, const RenderOptions& options);

// Returns the bytes that an image takes at most while it is made: the film's sums, the image that is
// developed from them, and, if checkpoints are kept or resumed, the sums once more. The scene and a method's
// maps come on top.
std::uint64_t image_memory(const Job& job, const RenderOptions& options);

// Throws InputError if there is less memory than that.
void require_image_memory(const Job& job, const RenderOptions& options);

// Warns if the method misses the direct light, or all light, of a lamp that only particles carry.
void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

// Warns if media glow and the method does not look for that.
void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

}  // namespace lucerna
