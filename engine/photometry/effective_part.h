// The part of a luminaire with uneven luminance that counts for UGR [CIE 232:2019; Scheir 2017]: its
// luminance is filtered by a Gaussian of 12 mm full width at half maximum on the luminaire, and the part
// where it is above 500 cd/m² has a mean luminance L and a solid angle ω, which UGR's sum takes in the place
// of the whole luminaire's: L² ω / p².
#pragma once

#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/photometry/illuminance.h"

namespace lucerna {

// Full width at half maximum of a Gaussian over its standard deviation.
inline constexpr double kFwhmOverSigma = 2.3548200450309493;

// Light that is sampled in one direction from the eye.
struct SeenLight {
    V3f w;                // unit, towards the luminaire
    double distance = 0;  // m, > 0
    double flux = 0;      // L dω [cd/m² sr], divided by the density of its sample
    double position = 1;  // position index
};

struct EffectivePart {
    double solid_angle = 0;  // sr; 0: nothing is above the limit
    double luminance = 0;    // cd/m², mean
    Reading95 term;          // L² ω / p²
};

// Estimates the effective part from equal, independent batches, at least two, of samples of a luminaire; each
// batch's fluxes are to be divided by `of_batch` samples. `fwhm` > 0 is the width of the filter [m].
EffectivePart effective_part(std::span<const std::vector<SeenLight>> batches, int of_batch, double fwhm);

}  // namespace lucerna
