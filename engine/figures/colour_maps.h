// Colour maps from numbers in [0, 1] or [-1, 1] to colours whose lightness encodes the number. All colours
// are display-referred sRGB.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"

namespace lucerna {

// Returns matplotlib's viridis, from dark violet at 0 over blue and green to yellow at 1. It is perceptually
// uniform, also for viewers with red-green colour blindness [van der Walt and Smith 2015] (CC0).
Rgb viridis_colour(double v);
// Returns matplotlib's magma, from black at 0 over violet and orange to pale yellow at 1 [van der Walt and
// Smith 2015] (CC0). FLIP's maps use it.
Rgb magma_colour(double v);
// Returns blue at -1, nearly white at 0 and red at 1, equally dark on both sides; other values are clamped.
Rgb diverging_colour(double v);

enum class ColourMap : std::uint8_t { viridis, magma, diverging };

// Returns the names in the order of the enumeration.
std::span<const std::string_view> colour_map_names();
// Returns nothing for an unknown name.
std::optional<ColourMap> colour_map_named(std::string_view name);

// Returns the colour at a share in [0, 1] of the way from the map's first colour to its last; other values
// are clamped.
Rgb colour_at(ColourMap map, double share);

// Colours for values below and above a range and for NaN, which the map itself does not contain.
struct OutsideColours {
    Rgb below, above, missing;
};
OutsideColours outside_colours(ColourMap map);

}  // namespace lucerna
