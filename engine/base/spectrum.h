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

#include "engine/base/cie.h"
#include "engine/base/vec.h"

namespace lucerna {

using Spectrum = std::vector<SpectralSample>;  // in rising order of wavelengths, linear in between

// Beyond its first and last sample a spectrum keeps their values (as pbrt's measured ones do), here over the
// visible range, 360 to 830 nm.
// The luminance is ∫ s ȳ dλ / ∫ ȳ dλ: a constant spectrum of value c has luminance c. Colours outside
// the gamut are mixed with grey of the same luminance. Requires at least one sample.
Rgb emission_rgb(std::span<const SpectralSample> spectrum);
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
std::span<const std::string_view> illuminant_names();
// CIE daylight of a correlated colour temperature of 4000 to 25000 K, 100 at 560 nm.
Spectrum daylight_spectrum(double kelvin);

// Lines of "wavelength value" (nm) with # comments; or all numbers in any layout. Throws InputError naming
// file and line: not readable, an odd count, a word that is no number, wavelengths that do not rise.
Spectrum read_spd(const std::filesystem::path& file);

}  // namespace lucerna
