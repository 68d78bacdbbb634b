// The layers of an image's file (docs/reference/layers.md): which of them are kept, and the denoised light
// groups.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/image/image.h"
#include "engine/render/job.h"

namespace lucerna {

// Names of the image's light groups, in the order of their channels.
std::vector<std::string> light_groups_of(const Image& image);
// "lightgroup.NAME"
std::string layer_of_group(const std::string& group);
// Channels `layer`.R .G .B as an image; none unless all three are there.
std::optional<Image> colours_of_layer(const Image& image, const std::string& layer);

// Which layers of an image its file has: by layers_of_job()'s names; empty: all. Single channels may be
// named, too.
using LayerNames = std::vector<std::string>;

// Denoises each light group whose halves are in the image, by itself, and adds denoised.lightgroup.NAME.R .G
// .B, if some of them are chosen. `file` is named in errors.
void add_denoised_groups(Image& image, const LayerNames& chosen, const std::string& file,
                         const Workers& workers);

// Names separated by commas or line breaks. "true", what a flag without a value has, is none of them.
LayerNames parse_layers(const std::string& words);
// The names that may be chosen of what a render of this job with all layers writes.
std::vector<std::string> layers_of_job(const Job& job);
// Throws InputError for a name that is none of them.
void require_layers(const Location& at, const LayerNames& chosen, const Job& job);
// Leaves R, G, B, their variances and the chosen layers; none chosen: all.
void keep_layers(Image& image, const LayerNames& chosen);

}  // namespace lucerna
