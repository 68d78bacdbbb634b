// Defines colour spaces of linear red, green and blue by their CIE XYZ. Renders are in a WorkingSpace
// (working_space.h), by default linear sRGB.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string_view>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"

namespace lucerna {

// Maps colours linearly: c becomes (rows[0]·c, rows[1]·c, rows[2]·c).
struct RgbMatrix {
    std::array<V3d, 3> rows{V3d(1, 0, 0), V3d(0, 1, 0), V3d(0, 0, 1)};

    V3d operator*(const V3d& c) const { return {rows[0].dot(c), rows[1].dot(c), rows[2].dot(c)}; }
    // Returns the map that applies `first`, then this one.
    RgbMatrix operator*(const RgbMatrix& first) const;
};

// Holds x and y of red, green, blue and white, in the order of OpenEXR's attribute "chromaticities".
using Chromaticities = std::array<float, 8>;

struct ColourSpace {
    std::string_view name;  // empty for a space without a name here
    Chromaticities chromaticities;
    // Holds CIE XYZ of red, green and blue, each 1. White (1, 1, 1) is D65 of luminance 1 in every space:
    // colours of a space with another white are adapted by the Bradford transform [Lam 1985].
    std::array<V3d, 3> primaries;
    RgbMatrix from_xyz_matrix;

    // Returns the luminances of red, green and blue, each 1.
    V3d luminances() const { return {primaries[0].y, primaries[1].y, primaries[2].y}; }
    V3d to_xyz(const V3d& rgb) const {
        return rgb.x * primaries[0] + rgb.y * primaries[1] + rgb.z * primaries[2];
    }
    // Returns components that are negative for colours outside the gamut.
    V3d from_xyz(const V3d& xyz) const { return from_xyz_matrix * xyz; }
};

// Returns "srgb" (linear), "rec2020", "dci-p3" (white D65), "acescg" and "aces2065-1", in this order.
std::span<const ColourSpace> colour_spaces();
// Returns null for an unknown name.
const ColourSpace* find_colour_space(std::string_view name);

// Returns the space of these chromaticities: the named one within 0.001 of each, otherwise one without a
// name. Returns none if they span no space (a primary or white without luminance, collinear, not finite).
std::optional<ColourSpace> colour_space_of(const Chromaticities& chromaticities);

// Returns the map from colours of one space to those of another.
RgbMatrix conversion(const ColourSpace& from, const ColourSpace& to);

// Returns the CIE XYZ of the colour that looks under D65 as `xyz` does under `white`, of luminance 1, by the
// Bradford transform [Lam 1985]: white itself becomes kWhiteXyz. All three cones must respond to the white.
V3d adapted_to_d65(const V3d& xyz, const V3d& white);

// Returns the colour with no component below 0: outside the gamut it is mixed with as much grey of its
// luminance as needed. `weights` are the luminances of the three components. Black without luminance.
V3d held_in_gamut(const V3d& rgb, const V3d& weights);

// These convert a linear component to sRGB's code and back, both from 0 to 1 [IEC 61966-2-1].
inline float srgb_encoded(float linear) {
    return linear <= 0.0031308F ? 12.92F * linear : 1.055F * pow(linear, 1 / 2.4F) - 0.055F;
}
inline float srgb_decoded(float code) {
    return code <= 0.04045F ? code / 12.92F : pow((code + 0.055F) / 1.055F, 2.4F);
}

}  // namespace lucerna
