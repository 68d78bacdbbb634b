// Divides a lamp into lamps of one spectrum each.
#pragma once

#include <vector>

#include "lights/lumigraph.h"
#include "lights/spectral_basis.h"

namespace lucerna {

struct SpectralLamp {
    Lumigraph lamp;         // of one colour
    BandSpectrum spectrum;  // spectral flux per lumen [W/(nm lm)]
};

// The parts have the lamp's frame and unit. Their flux is what their spectrum has of the lamp's luminous
// flux, on the scale of the lamp's flux. Throws InputError if the spectra of a slab are not known, or if none
// has light.
std::vector<SpectralLamp> spectral_lamps(const Lumigraph& lamp);

}  // namespace lucerna
