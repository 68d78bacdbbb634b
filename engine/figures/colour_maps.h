// Colour maps: a number from 0 to 1, or from -1 to 1, as a colour whose lightness tells the number. All
// colours are display-referred sRGB.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"

namespace lucerna {

// 0 dark violet to 1 yellow over blue and green: matplotlib's viridis, perceptually uniform, also to those
// who do not tell red from green [van der Walt and Smith 2015] (CC0).
Rgb viridis_colour(double v);
// 0 black to 1 pale yellow over violet and orange: matplotlib's magma [van der Walt and Smith 2015] (CC0), in
// which FLIP's maps are shown.
Rgb magma_colour(double v);
// -1 blue, 0 nearly white, 1 red, and as dark on either side; what lies beyond is shown as the end.
Rgb diverging_colour(double v);

enum class ColourMap : std::uint8_t { viridis, magma, diverging };

// In the order of the enumeration.
std::span<const std::string_view> colour_map_names();
// None for another name.
std::optional<ColourMap> colour_map_named(std::string_view name);

// The colour at a share of the way from the map's first to its last, in [0, 1]; outside it is held.
Rgb colour_at(ColourMap map, double share);

// What lies below a range, above it, or is no number: colours that the map itself does not have.
struct OutsideColours {
    Rgb below, above, missing;
};
OutsideColours outside_colours(ColourMap map);

}  // namespace lucerna
