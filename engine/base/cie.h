// From wavelengths to linear sRGB: the CIE 1931 standard observer, by fit.
//
// Source: Wyman, Sloan, Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching Functions",
// JCGT 2(2), 2013, the multi-lobe fit: within about 1 % of the tables' peaks.
#pragma once

#include <span>

#include "engine/base/vec.h"

namespace lucerna {

// Colour matching functions x̄, ȳ, z̄ at a wavelength in nm; ȳ is V(λ). About 0 outside the visible range.
V3d cie_xyz(double nanometres);

struct SpectralSample {
    double nanometres;
    double weight;  // spectral radiant flux, any unit
};
// ∫ weight (x̄, ȳ, z̄) dλ , weights linear between samples, for samples in rising order (a single one stands
// for itself). The matching functions are sampled every nanometre at least.
V3d spectrum_to_xyz(std::span<const SpectralSample> samples);

// Linear sRGB (Rec. 709 primaries, white D65). Components are negative for colours outside the gamut.
Rgb xyz_to_rgb(const V3d& xyz);
V3d rgb_to_xyz(const Rgb& c);

// The same colour with luminance 1, all components >= 0: a colour outside the gamut (pure green, say) is
// mixed with grey of the same luminance until no component is negative. White if the luminance is not
// positive or not finite.
Rgb colour_of_luminance_one(const Rgb& c);

}  // namespace lucerna
