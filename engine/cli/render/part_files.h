// Images of parts of a picture (engine/render/image_part.h): what their headers tell, and the picture of all.
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

// For the header of a part's image: which part, and of what. `layers`: the picture keeps those that are
// chosen.
std::map<std::string, std::string> part_attributes(const ImagePart& part, const Job& job, std::uint64_t seed,
                                                   bool layers, const LayerNames& chosen);

struct MergedParts {
    Image image;                // all channels of the parts, as they were stored
    bool keeps_layers = false;  // its halves and features are the picture's, not for a denoiser alone
    LayerNames chosen;          // of the picture's
};

// Throws InputError that names the files and parts: one is none of a picture, or of another one than the
// first, unfinished, there twice, or missing.
MergedParts merge_parts(const std::vector<std::filesystem::path>& files);

}  // namespace lucerna
