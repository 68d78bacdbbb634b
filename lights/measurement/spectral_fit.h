// Finds the spectra of which a lamp's light is a mixture at every place and in every direction.
//
// The rays are divided by place and direction into cells, and the spectra of the cells are factorised into
// mixtures of non-negative spectra by the multiplicative updates that maximise the likelihood of counted rays
// [Lee and Seung 2001]. A light field keeps three colours, from which it must be possible to tell the mixture
// (spectral_basis.h), so there are at most three spectra. The fewest are taken whose error is not above 1 %.
// The error is estimated by two quarters of the rays that had no part in the choice: the product of their two
// differences from the mixtures has the square of the error as its mean, without the noise of the rays.
#pragma once

#include "lights/ray_set.h"
#include "lights/spectral_basis.h"

namespace lucerna {

// Returns no spectra if the rays' spectra are not known, or are invisible. A lamp of at most three different
// spectra, whose colours differ enough, has these. `error` is an upper bound with a confidence of 95 %.
SpectralBasis spectral_basis(const RaySet& rays);

}  // namespace lucerna
