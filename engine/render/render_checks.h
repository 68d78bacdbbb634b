// What is looked at before a render begins: memory, and light that the picture will lack.
#pragma once

#include <cstdint>

#include "engine/base/monitor.h"
#include "engine/integrators/settings.h"
#include "engine/render/render.h"
#include "engine/scene/scene.h"

namespace lucerna {

// The memory that an image takes while it is made.

// Bytes at the most, of the image alone: the film's sums, the image that is made of them, and, where
// checkpoints are kept, the sums once more. What the scene and a method's maps take comes on top.
std::uint64_t image_memory(const Job& job, const RenderOptions& options);

// Throws InputError if there is not as much: before any work.
void require_image_memory(const Job& job, const RenderOptions& options);

// Lights that only particles carry, media that glow, and methods that do not look for them there.

// One warning if some light's direct light, or all of its light, will be missing from the picture.
void warn_of_unseen_lights(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

// One warning if media glow and the method does not look for that.
void warn_of_glowing_media(const Scene& scene, const IntegratorSettings& method, Monitor& monitor);

}  // namespace lucerna
