// The memory that an image takes while it is made.
#pragma once

#include <cstdint>

#include "engine/render/render.h"

namespace lucerna {

// Bytes at the most, of the image alone: the film's sums, the image that is made of them, and, where
// checkpoints are kept, the sums once more. What the scene and a method's maps take comes on top.
std::uint64_t image_memory(const Job& job, const RenderOptions& options);

// Throws InputError if there is not as much: before any work.
void require_image_memory(const Job& job, const RenderOptions& options);

}  // namespace lucerna
