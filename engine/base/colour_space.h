// The spaces that linear red, green and blue may be numbers of. Rendering is in linear sRGB (vec.h); what
// comes in another space is brought there by way of CIE XYZ.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "engine/base/vec.h"

namespace lucerna {

struct ColourSpace {
    std::string_view name;
    // CIE XYZ of red, green and blue, each 1. White (1, 1, 1) is D65 of luminance 1 in every space: where a
    // space has another white, colours are adapted by the Bradford transform [Lam 1985].
    std::array<V3d, 3> primaries;

    V3d to_xyz(const V3d& rgb) const {
        return rgb.x * primaries[0] + rgb.y * primaries[1] + rgb.z * primaries[2];
    }
};

// "srgb", "rec2020", "dci-p3" (white D65), "acescg" and "aces2065-1".
std::span<const ColourSpace> colour_spaces();
// Null for another name.
const ColourSpace* find_colour_space(std::string_view name);

}  // namespace lucerna
