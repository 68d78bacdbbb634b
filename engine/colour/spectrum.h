// Converts spectra (samples over wavelengths, black bodies, daylight) to colours.
//
// A spectrum becomes linear sRGB in one of two ways, because "white" means different things for a light and a
// surface. A light's colour is absolute: equal energy at all wavelengths is slightly pink compared to D65. A
// ratio (reflectance, absorption, index of refraction) is relative to its own white: 1 everywhere is (1, 1,
// 1), since otherwise white paper would tint a room.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

inline constexpr int kFirstVisible = 360, kLastVisible = 830;  // nm; the range of the observer's table

// Returns the colour matching functions x̄, ȳ, z̄ of the CIE 1931 standard observer, 2 degrees [CIE
// 018:2019], at a wavelength in nm: the table's values every nanometre, linear in between. ȳ is V(λ), 1 at
// 555 nm. 0 outside 360 to 830 nm and for NaN.
V3d cie_xyz(double nanometres);

struct SpectralSample {
    double nanometres;
    double weight;  // spectral radiant flux, any unit
    bool operator==(const SpectralSample&) const = default;
};
// Returns ∫ weight (x̄, ȳ, z̄) dλ for samples in ascending order, with weights linear in between; a single
// sample is a line. It is exact up to rounding, because the matching functions are linear between wavelengths
// of the table.
V3d spectrum_to_xyz(std::span<const SpectralSample> samples);
// Returns ∫ weight dλ of such samples; a line's is its weight. Samples that descend count as none.
double spectrum_watts(std::span<const SpectralSample> samples);
// Returns the CIE XYZ per watt of light of this spectrum; 0 if it has no power.
V3d xyz_per_watt(std::span<const SpectralSample> samples);

// White is D65 with luminance 1: rgb_to_xyz(Rgb(1)).
inline constexpr V3d kWhiteXyz{0.950456, 1, 1.088754};

// These convert to and from linear sRGB (Rec. 709 primaries, white D65), negative outside the gamut.
Rgb xyz_to_rgb(const V3d& xyz);
V3d rgb_to_xyz(const Rgb& c);

// Returns the colour with luminance 1, all components >= 0: a colour outside the gamut (e.g. pure green) is
// mixed with grey of its luminance until no component is negative. White if the luminance is not positive and
// finite.
Rgb colour_of_luminance_one(const Rgb& c);

using Spectrum = std::vector<SpectralSample>;  // in ascending order of wavelengths, linear in between

// Returns the colour of emission. Beyond its first and last sample a spectrum is constant within the visible
// range, 360 to 830 nm (as pbrt's measured ones). The luminance is ∫ s ȳ dλ / ∫ ȳ dλ, so that a constant
// spectrum of value c has luminance c. Colours outside the gamut are mixed with grey of their luminance.
// Requires at least one sample.
Rgb emission_rgb(std::span<const SpectralSample> spectrum);
// Returns ∫ ȳ dλ [nm], by which emission_rgb() divides: 106.86.
double luminous_width();
// Returns this colour before conversion to RGB: CIE XYZ, with Y the luminance.
V3d emission_xyz(std::span<const SpectralSample> spectrum);
// Returns a ratio, channel by channel relative to a spectrum of 1. It is not negative and within the bounds
// of the samples, which a narrow spectrum's colour would exceed.
Rgb ratio_rgb(std::span<const SpectralSample> spectrum);
// Returns linear sRGB of a spectrum of 1, by which ratios are divided.
Rgb equal_energy_rgb();
// Converts CIE XYZ to linear sRGB within the gamut; D65 of luminance 1 is (1, 1, 1).
Rgb xyz_colour(const V3d& xyz);

// Returns Planck's law, 360 to 830 nm, scaled so that its largest value over all wavelengths, given by Wien's
// displacement law, is 1. `kelvin` > 0.
Spectrum blackbody_spectrum(double kelvin);

// These return CIE standard illuminants of luminance 1: "A", "D50", "D65" by their published formulae, "F1"
// to "F12" by their published chromaticities. None for an unknown name.
std::optional<Rgb> illuminant_rgb(std::string_view name);
std::optional<V3d> illuminant_xyz(std::string_view name);
std::span<const std::string_view> illuminant_names();
// Returns the relative spectrum of "A", "D50" and "D65". None for other names.
std::optional<Spectrum> illuminant_spectrum(std::string_view name);
// Returns CIE daylight of a correlated colour temperature of 4000 to 25000 K, normalised to 100 at 560 nm.
Spectrum daylight_spectrum(double kelvin);

// Reads lines of "wavelength value" (nm) with # comments, or the numbers in any layout. Throws InputError
// that names file and line: unreadable, an odd count, a word that is no number, descending wavelengths.
Spectrum read_spd(const std::filesystem::path& file);

}  // namespace lucerna
