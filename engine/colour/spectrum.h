// Spectra as people have them: samples over wavelengths, bodies that glow, daylight; and what colour they
// are.
//
// A spectrum becomes linear sRGB in one of two ways, because a light and a surface mean different things by
// "white". A light's colour is seen as it is: equal energy at all wavelengths is a little pink beside D65. A
// ratio (reflectance, absorption, index of refraction) is judged against its own white: 1 everywhere is
// (1, 1, 1), or white paper would tint a room.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna {

// From wavelengths to linear sRGB by the CIE 1931 standard observer, 2 degrees [CIE 018:2019].

inline constexpr int kFirstVisible = 360, kLastVisible = 830;  // nm; the range of the observer's table

// Colour matching functions x̄, ȳ, z̄ at a wavelength in nm: the table's values every nanometre, linear in
// between. ȳ is V(λ), 1 at 555 nm. 0 outside 360 to 830 nm and for NaN.
V3d cie_xyz(double nanometres);

struct SpectralSample {
    double nanometres;
    double weight;  // spectral radiant flux, any unit
};
// ∫ weight (x̄, ȳ, z̄) dλ , weights linear between samples, for samples in rising order (a single one stands
// for itself). Exact but for rounding: the matching functions are linear between the table's wavelengths.
V3d spectrum_to_xyz(std::span<const SpectralSample> samples);

// White, D65, of luminance 1: rgb_to_xyz(Rgb(1)).
inline constexpr V3d kWhiteXyz{0.950456, 1, 1.088754};

// Linear sRGB (Rec. 709 primaries, white D65). Components are negative for colours outside the gamut.
Rgb xyz_to_rgb(const V3d& xyz);
V3d rgb_to_xyz(const Rgb& c);

// The same colour with luminance 1, all components >= 0: a colour outside the gamut (pure green, say) is
// mixed with grey of the same luminance until no component is negative. White if the luminance is not
// positive or not finite.
Rgb colour_of_luminance_one(const Rgb& c);

using Spectrum = std::vector<SpectralSample>;  // in rising order of wavelengths, linear in between

// Beyond its first and last sample a spectrum keeps their values (as pbrt's measured ones do), here over the
// visible range, 360 to 830 nm.
// The luminance is ∫ s ȳ dλ / ∫ ȳ dλ: a constant spectrum of value c has luminance c. Colours outside
// the gamut are mixed with grey of the same luminance. Requires at least one sample.
Rgb emission_rgb(std::span<const SpectralSample> spectrum);
// ∫ ȳ dλ [nm], what it is divided by: 106.86.
double luminous_width();
// The same before it becomes red, green and blue: CIE XYZ, Y the luminance as above.
V3d emission_xyz(std::span<const SpectralSample> spectrum);
// Channel by channel relative to a spectrum of 1. Not negative; within the bounds of the samples, which a
// narrow spectrum's colour would leave.
Rgb ratio_rgb(std::span<const SpectralSample> spectrum);
// Linear sRGB's response to a spectrum of 1, before ratios are divided by it.
Rgb equal_energy_rgb();
// The same for a colour given as CIE XYZ, white D65 of luminance 1 being (1, 1, 1).
Rgb xyz_colour(const V3d& xyz);

// Planck's law, 360 to 830 nm, scaled so that its largest value over all wavelengths is 1 (Wien's
// displacement law says where that lies). `kelvin` > 0.
Spectrum blackbody_spectrum(double kelvin);

// CIE standard illuminants: "A", "D50", "D65" by their published formulae, "F1" to "F12" by their published
// chromaticities. Luminance 1. Nothing for another name.
std::optional<Rgb> illuminant_rgb(std::string_view name);
std::optional<V3d> illuminant_xyz(std::string_view name);
std::span<const std::string_view> illuminant_names();
// CIE daylight of a correlated colour temperature of 4000 to 25000 K, 100 at 560 nm.
Spectrum daylight_spectrum(double kelvin);

// Lines of "wavelength value" (nm) with # comments; or all numbers in any layout. Throws InputError naming
// file and line: not readable, an odd count, a word that is no number, wavelengths that do not rise.
Spectrum read_spd(const std::filesystem::path& file);

}  // namespace lucerna
