// Images of parts (engine/render/image_part.h): the facts in their headers, and the merged image.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "engine/cli/image/image_layers.h"
#include "engine/image/image.h"
#include "engine/render/image_part.h"
#include "engine/render/job.h"

namespace lucerna {

// Returns a part's header: its number and the facts of the whole image. `layers` tells whether the image
// keeps the chosen layers.
std::map<std::string, std::string> part_attributes(const ImagePart& part, const Job& job, std::uint64_t seed,
                                                   bool layers, const LayerNames& chosen);

struct MergedParts {
    Image image;                // all channels of the parts, as stored
    bool keeps_layers = false;  // halves and features belong to the image and not only to the denoiser
    LayerNames chosen;          // layers of the image
};

// Throws InputError naming files and parts if a file is no part, belongs to another image than the first, is
// unfinished, occurs twice, or is missing.
MergedParts merge_parts(const std::vector<std::filesystem::path>& files);

}  // namespace lucerna
