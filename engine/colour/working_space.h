// The colour space that a render is in: linear sRGB, Rec. 2020 or ACEScg. The last two hold lamps that sRGB
// does not, a green LED's chip among them.
//
// Two kinds of numbers are told apart. A *ratio* (reflectance, absorption, index of refraction, a texel) is
// what a surface does to each channel: plain components of the space, 1 for a perfect white. *Light*
// (radiance, intensity, flux) is the same components, each times the luminance of its primary over that of
// Rec. 709's primary. Light is multiplied by ratios channel by channel, so such a factor per channel changes
// no image; but with it luminance(Rgb) of vec.h is the luminance of light whatever the space: what is told
// and asked in lm, lx or cd/m² has the same weights everywhere, and transport need not know of colour spaces.
// White light of luminance 1 is white(), which is (1, 1, 1) in sRGB alone. The film takes the factors out
// again.
//
// All colours enter here and leave here. In sRGB the numbers are what they were given as, bit for bit.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"
#include "engine/colour/colour_space.h"
#include "engine/colour/spectrum.h"

namespace lucerna {

class WorkingSpace {
  public:
    WorkingSpace() = default;  // linear sRGB
    // One of names(), of colour_spaces().
    explicit WorkingSpace(const ColourSpace& space);
    static std::span<const std::string_view> names();
    // None for another name.
    static std::optional<WorkingSpace> named(std::string_view name);

    const ColourSpace& space() const { return space_ ? *space_ : colour_spaces().front(); }
    std::string_view name() const { return space().name; }
    bool is_srgb() const { return space_ == nullptr; }

    // Of linear sRGB, no component negative; all of them are in the gamut. Grey stays as it is.
    Rgb ratio(const Rgb& srgb) const;
    Rgb light(const Rgb& srgb) const { return ratio(srgb) * white_; }
    // Of CIE XYZ, white D65. What is outside the gamut is mixed with grey of its luminance.
    Rgb ratio_of_xyz(const V3d& xyz) const;
    Rgb light_of_xyz(const V3d& xyz) const;
    // Negative components outside the gamut.
    Rgb open_light_of_xyz(const V3d& xyz) const;
    // Whether the colour is in the gamut, to rounding.
    bool holds(const V3d& xyz) const;

    // As ratio_rgb() and emission_rgb() (spectrum.h) take a spectrum.
    Rgb ratio_of_spectrum(std::span<const SpectralSample> spectrum) const;
    Rgb light_of_spectrum(std::span<const SpectralSample> spectrum) const;

    V3d light_to_xyz(const Rgb& light) const;
    // The space's own components.
    Rgb light_to_rgb(const Rgb& light) const { return light / white_; }

    // Of D65, luminance 1.
    const Rgb& white() const { return white_; }
    // The luminances of the space's primaries: luminance of a ratio as seen under white.
    const V3f& weights() const { return weights_; }

    // Of the three components, linear, to open_light_of_xyz(): rows.
    RgbMatrix light_from_xyz() const;

    bool operator==(const WorkingSpace& other) const { return space_ == other.space_; }

  private:
    const ColourSpace* space_ = nullptr;  // null: linear sRGB
    Rgb white_{1, 1, 1};
    V3f weights_{0.212671F, 0.715160F, 0.072169F};
    RgbMatrix from_srgb_;
};

// Light of luminance 1 of a colour that is outside the gamut or in it. White if xyz has no luminance.
Rgb light_of_luminance_one(const WorkingSpace& colours, const V3d& xyz);

}  // namespace lucerna
