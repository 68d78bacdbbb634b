// The spectra of a lamp, as a light field keeps them.
//
// A field of several colours has CIE XYZ everywhere (ColourChannels). If its light is everywhere a mixture of
// at most three known spectra with different colours, XYZ tell the mixture: the luminous flux of each
// spectrum is a linear function of X, Y and Z. So a lamp splits into lamps of one spectrum each, and spectral
// irradiance is the sum of their illuminances times their spectra.
#pragma once

#include <vector>

#include "engine/colour/rendition.h"

namespace lucerna {

struct SpectralBasis {
    static constexpr std::size_t kMost = 3;
    // Spectral flux per lumen [W/(nm lm)], one to kMost; band_lumens() of each is 1. Empty: not known.
    std::vector<BandSpectrum> spectra;
    // The error of the lamp's spectra by place and direction as mixtures of these, root mean square,
    // relative, in intervals of 20 nm; 0 if they are exact.
    double error = 0;

    bool known() const { return !spectra.empty(); }
    bool operator==(const SpectralBasis&) const = default;
};

// Returns, for each spectrum, the weights of X, Y and Z that give the luminous flux of its part of the light,
// on the scale on which Y is luminous flux. They add up to Y. Three spectra give back X and Z as well, two
// the nearest that a mixture has.
std::vector<V3d> weights_of_xyz(const SpectralBasis& basis);
// Returns the least distance in (X/Y, Z/Y) of a spectrum's colour from the line or the point of the others,
// over its distance from the origin: how much XYZ tell of the mixture. 1 for one spectrum.
double separation(const SpectralBasis& basis);

}  // namespace lucerna
