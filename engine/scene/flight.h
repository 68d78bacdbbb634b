// A flight through media: how far light comes, and what it loses and gains on the way.
//
// fly() draws a distance for a path; transmittance() estimates the share that passes. Both are unbiased for
// any density: where it varies, null collisions fill it up to a bound. What media absorb is taken off the
// throughput, never decided by chance. scatter_within() draws a place on a way of which the end is of
// interest anyway: where the media do not vary, none of its draws is lost beyond the end.
//
// Sources: Woodcock et al. 1965 (delta tracking); Novák, Selle and Jarosz 2014 (ratio tracking); Miller,
// Georgiev and Jarosz 2019, "A null-scattering path integral formulation of light transport": the weights
// that make one distance serve three channels. The channel that draws it is chosen in proportion to the
// throughput, and the estimate is divided by the mean over all channels' densities, so no colour gains more
// than the sum of all.
#pragma once

#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_along.h"

namespace lucerna {

struct Flight {
    bool scattered = false;  // within the media; otherwise the end was reached
    double t = 0;            // where, along the ray; scene units
    float g = 0;             // of the medium that scattered
    Rgb throughput{0.0F};    // after scattering (black: absorbed), or at the end
    Rgb emitted{0.0F};       // by the media on the way, throughput included, W/(m² sr)
};

// `throughput` is not black. Takes one pair of numbers from `sampler`, the rest from a branch of it.
Flight fly(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// A place at which light is scattered into the way, back towards its beginning.
struct InScattering {
    double t = 0;       // along the ray; scene units
    float g = 0;        // of the medium that scatters there
    Rgb flow{0.0F};     // the share that reaches the beginning, over the density of t, scene units
    Rgb sigma_s{0.0F};  // of all media there, per scene unit
};

// For any function F of place and phase function, the mean of flow·F (0 without a place) is the integral over
// the way of transmittance · F, where media scatter at all. `throughput`, not black, is what the light is
// worth to the path, and only serves to choose well. Takes one pair of numbers from `sampler`, the rest from
// a branch of it.
std::optional<InScattering> scatter_within(MediaAlong along, const Rgb& throughput, Sampler& sampler);

// Its mean is the transmittance from end to end: 0 over an infinite way through a medium. Exact, and without
// random numbers, where nothing varies.
Rgb transmittance(MediaAlong along, Sampler& sampler);

}  // namespace lucerna
