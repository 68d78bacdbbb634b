// The layers of an image's file (docs/reference/layers.md): the selection to keep, and denoised light groups.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"
#include "engine/render/job.h"

namespace lucerna {

// Returns the names of the image's light groups, in the order of their channels.
std::vector<std::string> light_groups_of(const Image& image);
// Returns "lightgroup.NAME".
std::string layer_of_group(const std::string& group);
// Returns channels `layer`.R .G .B as an image, or nothing unless all three exist.
std::optional<Image> colours_of_layer(const Image& image, const std::string& layer);

// The layers to keep in a file, by the names of layers_of_job() or of single channels. Empty means all.
using LayerNames = std::vector<std::string>;

// Denoises separately each light group whose halves are in the image, and adds denoised.lightgroup.NAME.R .G
// .B if some of them are chosen. Errors name `file`.
void add_denoised_groups(Image& image, const LayerNames& chosen, const std::string& file,
                         const Workers& workers);

// Parses names separated by commas or line breaks. Ignores "true", the value of a flag without one.
LayerNames parse_layers(const std::string& words);
// Returns the names that may be chosen from the layers of a render of this job with all layers.
std::vector<std::string> layers_of_job(const Job& job);
// Throws InputError for an unknown name.
void require_layers(const Location& at, const LayerNames& chosen, const Job& job);
// Keeps R, G, B, their variances and the chosen layers, or all layers if none is chosen.
void keep_layers(Image& image, const LayerNames& chosen);

}  // namespace lucerna
