// Describes light by its spectrum, as lighting standards ask: correlated colour temperature, colour rendering
// index, colour fidelity and gamut, and the effect on the eye's melanopsin.
//
// All of them are sums over wavelengths every 5 nm from 380 to 780 nm, in which the standards tabulate their
// test samples and observers. Between these wavelengths the tables count as linear.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "engine/colour/chromaticity.h"
#include "engine/colour/spectrum.h"

namespace lucerna {

inline constexpr std::size_t kBands = 81;
inline constexpr double kFirstBand = 380, kBandWidth = 5;  // nm

// Holds a spectral quantity per nanometre at kFirstBand + i kBandWidth.
struct BandSpectrum {
    std::array<double, kBands> at{};

    static constexpr double nanometres(std::size_t i) {
        return kFirstBand + kBandWidth * static_cast<double>(i);
    }
    BandSpectrum& operator+=(const BandSpectrum& other) {
        for (std::size_t i = 0; i < kBands; ++i) at[i] += other.at[i];
        return *this;
    }
    BandSpectrum& operator*=(double factor) {
        for (double& value : at) value *= factor;
        return *this;
    }
    friend BandSpectrum operator*(double factor, BandSpectrum spectrum) { return spectrum *= factor; }
    // Returns ∫ dλ by the trapezoidal rule without halves at the ends, as all sums here.
    double integral() const;
    bool operator==(const BandSpectrum&) const = default;
};

// Returns the spectrum, linear between its samples and 0 beyond them, in bands. Samples 5 nm or more apart
// are interpolated, because tables of that step are meant for sums of that step. Finer ones, and the single
// sample of a line, are shared between the two nearest wavelengths, such that sums with tables that are
// linear between these are exact. Light outside 380 to 780 nm is left out.
BandSpectrum banded(std::span<const SpectralSample> samples);

// Returns ∫ s (x̄, ȳ, z̄) dλ of the CIE 1931 observer.
V3d band_xyz(const BandSpectrum& spectrum);
// Returns the luminous flux of a spectral flux in W/nm, or the illuminance of a spectral irradiance in
// W/(m² nm): 683 lm/W ∫ s ȳ dλ.
double band_lumens(const BandSpectrum& spectrum);
// Returns the melanopic equivalent daylight (D65) illuminance [lx] of a spectral irradiance in W/(m² nm), for
// an observer of 32 years [CIE S 026:2018, 3.9].
double melanopic_edi(const BandSpectrum& spectrum);

// Compares the colours of test samples under a light and under a reference illuminant of the same correlated
// colour temperature: a black body or daylight.
struct ColourRendition {
    ColourTemperature temperature;
    // The special colour rendering indices R_1 to R_14, of which the general one, R_a, is the mean of the
    // first eight [CIE 13.3-1995].
    std::array<double, 14> special;
    double general;
    double fidelity;  // R_f [CIE 224:2017; TM-30-20]
    double gamut;     // R_g [TM-30-20]

    double r9() const { return special[8]; }
};
// Returns none if the light has no correlated colour temperature, or one above 25000 K, for which there is no
// reference illuminant.
std::optional<ColourRendition> colour_rendition(const BandSpectrum& spectrum);

// The standards' tables, in bands.

// Returns x̄, ȳ, z̄ of the CIE 1964 standard observer, 10 degrees [CIE 018:2019].
const std::array<V3d, kBands>& cie_xyz_10();
// Returns s_mel, 1 at 490 nm [CIE S 026:2018, table 2].
const std::array<double, kBands>& melanopic_action();
// Return the reflectance of sample `i`, 0 to 13, of CIE 13.3 and that of sample `i`, 0 to 98, of TM-30.
std::array<double, kBands> rendering_sample(std::size_t i);
std::array<double, kBands> fidelity_sample(std::size_t i);

}  // namespace lucerna
