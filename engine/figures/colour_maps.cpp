#include "engine/figures/colour_maps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

// Every sixteenth entry of the table of 256.
using SparseTable = std::array<unsigned, 17>;

// Linear interpolation is within 2.1 % of the whole table in each channel.
constexpr SparseTable kViridis{0x440154, 0x48186a, 0x472d7b, 0x424086, 0x3b528b, 0x33638d,
                               0x2c728e, 0x26828e, 0x21918c, 0x1fa088, 0x28ae80, 0x3fbc73,
                               0x5ec962, 0x84d44b, 0xaddc30, 0xd8e219, 0xfde725};
// Linear interpolation is within 1.2 % of the whole table.
constexpr SparseTable kMagma{0x000004, 0x0a0822, 0x1d1147, 0x36106b, 0x51127c, 0x6a1c81,
                             0x832681, 0x9c2e7f, 0xb73779, 0xd0416f, 0xe75263, 0xf56b5c,
                             0xfc8961, 0xfea772, 0xfec488, 0xfde2a3, 0xfcfdbf};

Rgb from_hex(unsigned colour) {
    return Rgb(static_cast<float>(colour >> 16 & 255U), static_cast<float>(colour >> 8 & 255U),
               static_cast<float>(colour & 255U)) /
           255.0F;
}

Rgb interpolated(const SparseTable& table, double v) {
    const double at = std::isnan(v) ? 0 : std::clamp(v, 0.0, 1.0) * static_cast<double>(table.size() - 1);
    const auto below = std::min<std::size_t>(static_cast<std::size_t>(at), table.size() - 2);
    const float share = static_cast<float>(at - static_cast<double>(below));
    return from_hex(table[below]) * (1 - share) + from_hex(table[below + 1]) * share;
}

// Returns linear sRGB of L*, chroma and hue (degrees) of CIE L*a*b*, mapped into the gamut.
Rgb lch_colour(double lightness, double chroma, double hue) {
    const auto cube = [](double t) {
        constexpr double kDelta = 6.0 / 29;
        return t > kDelta ? t * t * t : 3 * kDelta * kDelta * (t - 4.0 / 29);
    };
    const double y = (lightness + 16) / 116;
    const double a = chroma * cos(hue * kPiD / 180), b = chroma * sin(hue * kPiD / 180);
    const V3d white = rgb_to_xyz(Rgb(1));
    const Rgb c = xyz_to_rgb(V3d(cube(y + a / 500), cube(y), cube(y - b / 200)) * white);
    const auto clamped = [](float v) { return std::clamp(v, 0.0F, 1.0F); };
    return {clamped(c.x), clamped(c.y), clamped(c.z)};
}

constexpr std::array<std::string_view, 3> kNames{"viridis", "magma", "diverging"};

}  // namespace

Rgb viridis_colour(double v) {
    return interpolated(kViridis, v);
}

Rgb magma_colour(double v) {
    return interpolated(kMagma, v);
}

Rgb diverging_colour(double v) {
    constexpr double kPale = 96, kDark = 30, kChroma = 75;
    const double size = std::isnan(v) ? 0 : std::min(1.0, std::fabs(v));
    const Rgb c =
        lch_colour(kPale + (kDark - kPale) * size, kChroma * sin(size * kPiD * 0.7), v < 0 ? 270 : 35);
    return {srgb_encoded(c.x), srgb_encoded(c.y), srgb_encoded(c.z)};
}

std::span<const std::string_view> colour_map_names() {
    return kNames;
}

std::optional<ColourMap> colour_map_named(std::string_view name) {
    const auto found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end()) return std::nullopt;
    return static_cast<ColourMap>(found - kNames.begin());
}

Rgb colour_at(ColourMap map, double share) {
    switch (map) {
        case ColourMap::magma:
            return magma_colour(share);
        case ColourMap::diverging:
            return diverging_colour(2 * share - 1);
        case ColourMap::viridis:
            break;
    }
    return viridis_colour(share);
}

OutsideColours outside_colours(ColourMap map) {
    const Rgb grey(0.6F);
    switch (map) {
        case ColourMap::magma:
            return {from_hex(0x6fb7ff), from_hex(0x3ce8a0), grey};
        case ColourMap::diverging:
            return {from_hex(0x00c8c8), from_hex(0xff00c8), grey};
        case ColourMap::viridis:
            break;
    }
    return {from_hex(0xb9d4ff), from_hex(0xff3b30), grey};
}

}  // namespace lucerna
