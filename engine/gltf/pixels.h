// What is asked of a texture's pixels while a model is read: means, and what its alpha leaves of a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
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

// Width and height that a PNG or JPEG file says it has, without a look at its pixels; none if it is neither.
std::optional<std::pair<std::uint32_t, std::uint32_t>> picture_size(std::span<const std::byte> bytes);

}  // namespace lucerna
