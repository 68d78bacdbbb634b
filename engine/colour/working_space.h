// Represents the colour space of a render: linear sRGB, Rec. 2020 or ACEScg. The last two contain lamps that
// are outside sRGB's gamut, e.g. a green LED's chip.
//
// There are two kinds of numbers. A *ratio* (reflectance, absorption, index of refraction, a texel) is what a
// surface does to each channel: plain components of the space, 1 for a perfect white. *Light* (radiance,
// intensity, flux) is these components, each times the luminance of its primary over that of Rec. 709's
// primary. Light is multiplied by ratios channel by channel, so that such a factor per channel changes no
// image. With it, however, luminance(Rgb) of vec.h is the luminance of light whatever the space: values in
// lm, lx or cd/m² have the same weights everywhere, and transport is independent of colour spaces. White
// light of luminance 1 is white(), which is (1, 1, 1) only in sRGB. The film divides by the factors again.
//
// All colours are converted here on input and output. In sRGB the numbers stay as given, bit for bit.
//
// The components may also be three intervals of wavelengths instead of colours. Ratios are then their means
// over each interval, and all light is white with its luminance, because its spectrum is taken into account
// elsewhere: illuminance by such light tells how much of a lamp's light arrives in each interval.
#pragma once

#include <array>
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
    // Takes the element of colour_spaces() for one of names().
    explicit WorkingSpace(const ColourSpace& space);
    static std::span<const std::string_view> names();
    // Returns none for an unknown name.
    static std::optional<WorkingSpace> named(std::string_view name);

    // Returns the space of three adjoining intervals of wavelengths, by their limits in ascending order [nm].
    // Ratios that are given in sRGB count as linear between kBlue, kGreen and kRed, and constant beyond.
    static WorkingSpace of_intervals(const std::array<double, 4>& limits);
    static constexpr double kBlue = 450, kGreen = 540, kRed = 610;  // nm
    bool has_intervals() const { return limits_.has_value(); }

    // Intervals have the space sRGB.
    const ColourSpace& space() const { return space_ ? *space_ : colour_spaces().front(); }
    std::string_view name() const { return limits_ ? "intervals" : space().name; }
    bool is_srgb() const { return space_ == nullptr && !limits_; }

    // Returns the map of ratios from a colour space.
    RgbMatrix from(const ColourSpace& space) const;
    // Converts linear sRGB without negative components, which is always in the gamut. Grey stays as it is.
    Rgb ratio(const Rgb& srgb) const;
    Rgb light(const Rgb& srgb) const { return limits_ ? Rgb(luminance(srgb)) : ratio(srgb) * white_; }
    // Converts CIE XYZ, white D65. Colours outside the gamut are mixed with grey of their luminance.
    Rgb ratio_of_xyz(const V3d& xyz) const;
    Rgb light_of_xyz(const V3d& xyz) const;
    // Converts without a gamut limit: components are negative outside the gamut.
    Rgb open_light_of_xyz(const V3d& xyz) const;
    // Tells whether the colour is in the gamut, up to rounding.
    bool holds(const V3d& xyz) const;

    // These convert spectra as ratio_rgb() and emission_rgb() (spectrum.h) do.
    Rgb ratio_of_spectrum(std::span<const SpectralSample> spectrum) const;
    Rgb light_of_spectrum(std::span<const SpectralSample> spectrum) const;

    V3d light_to_xyz(const Rgb& light) const;
    // Returns the space's own components.
    Rgb light_to_rgb(const Rgb& light) const { return light / white_; }

    // Returns light of D65 with luminance 1.
    const Rgb& white() const { return white_; }
    // Returns the luminances of the space's primaries, by which a ratio has its luminance under white.
    const V3f& weights() const { return weights_; }

    // Returns the matrix of open_light_of_xyz(), one row per component.
    RgbMatrix light_from_xyz() const;

    bool operator==(const WorkingSpace& other) const {
        return space_ == other.space_ && limits_ == other.limits_;
    }

  private:
    V3d mean_over_intervals(std::span<const SpectralSample> spectrum) const;

    const ColourSpace* space_ = nullptr;  // null: linear sRGB
    Rgb white_{1, 1, 1};
    V3f weights_{0.212671F, 0.715160F, 0.072169F};
    RgbMatrix from_srgb_;
    std::optional<std::array<double, 4>> limits_;  // of intervals
};

// Returns light of luminance 1, moved into the gamut if necessary. White if xyz has no luminance.
Rgb light_of_luminance_one(const WorkingSpace& colours, const V3d& xyz);

}  // namespace lucerna
