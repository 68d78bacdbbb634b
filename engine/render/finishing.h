// The work that follows the samples of an image: the features of all pixels, and denoising. Its time is
// planned from rates that are measured on the machine as it is, so that a render with a limit of time leaves
// enough for it.
#pragma once

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

// The most samples of a pixel for its features; a render without a limit of time takes them at edges.
inline constexpr int kMostFeatureSamples = 16;

struct Finishing {
    bool denoises = true;
    int feature_samples = kMostFeatureSamples;
    double feature_seconds = 0;  // of the features that are still to be taken
    double denoise_seconds = 0;
    double seconds() const { return feature_seconds + denoise_seconds; }
};

// Measures the time of denoise() on a small image of noise, in seconds per pixel with these workers.
double measured_denoiser_seconds(const Workers& workers);

// Plans for an image of so many pixels and `seconds` in all. Features of one sample of each pixel take
// `first_features` seconds, and the denoiser `per_pixel`; 0: there are none.
Finishing plan_finishing(double pixels, double seconds, double first_features, double per_pixel);

}  // namespace lucerna
