// What is asked of a texture's pixels while a model is read: means, and what its alpha leaves of a surface.
#pragma once

#include <optional>
#include <vector>

#include "engine/base/vec.h"
#include "engine/gltf/model.h"

namespace lucerna {

// R, G, B, A, 8 bits each, top row first; not empty.
struct Pixels {
    int width = 0, height = 0;
    std::vector<unsigned char> rgba;
};

Rgb mean_linear(const Pixels& pixels);  // of the numbers as they stand
Rgb mean_srgb(const Pixels& pixels);    // of the colours that they encode
// Alpha times `factor`; with a cutoff 1 from there on and 0 below. None if everything is there.
std::optional<GltfCutout> cutout_of(const Pixels& pixels, double factor, std::optional<double> cutoff);

}  // namespace lucerna
