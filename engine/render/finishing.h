// The features of an image with a limit of time, and the work that follows its samples: developing, filling
// and denoising it, and what the caller does. Its time is planned from rates that are measured on the machine
// as it is, so that a render with a limit of time leaves enough for it.
#pragma once

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

// The most samples of a pixel for its features; a render without a limit of time takes them at edges.
inline constexpr int kMostFeatureSamples = 16;

struct Finishing {
    bool denoises = true;
    // The distance of the pixels that are denoised, 1, 2 or 4: those between are upsampled (FeatureFilter).
    // `least_spacing` is that of the plan.
    int spacing = 1, least_spacing = 1;
    int feature_samples = kMostFeatureSamples;
    double edge_samples = 0;         // of refine_features(), all pixels together
    double fill_seconds = 0;         // of complete_halves() and FeatureFilter, while pixels have no sample
    double develop_seconds = 0;      // of the film
    double all_denoise_seconds = 0;  // of all pixels
    double denoise_seconds() const { return all_denoise_seconds / (spacing * spacing); }
    double later_seconds = 0;  // of what the caller does after the render
    double seconds() const { return fill_seconds + develop_seconds + denoise_seconds() + later_seconds; }
    // Leaves out pixels as long as denoising takes much longer than the `left` seconds and more than a small
    // share of the time of the whole render: of a picture that is denoised in part, edges are lost.
    void denoise_within(double left, double whole);
};

// States how long the work takes.
struct FinishingRates {
    double features = 0;  // seconds, of one sample of each pixel; 0: there are none
    // Processor seconds per pixel: of developing a film, of filling pixels without a sample, of denoise() (0:
    // not denoised), of writing a channel of an OpenEXR file, of mapping the colours of a picture, and of the
    // exposure and the packing of a PNG file, which one thread does.
    double developing = 0, filling = 0, denoiser = 0, writing = 0, mapping = 0, packing = 0;
    int threads = 1;
    // The time by the clock over that of the processors: above 1 where other programs use them, too.
    double slowdown = 1;
};

// Measures them, but for the features, on an image of noise of at most so many pixels.
FinishingRates measured_rates(double pixels, const Workers& workers);

// States the caller's work after the render: how many images it denoises, and how many channels of an OpenEXR
// file and how many PNG files it writes.
struct LaterWork {
    double denoised = 0, channels = 0, pictures = 0;
};

// Plans for an image of so many pixels and `seconds` in all. `denoises`: whether the image is to be denoised.
Finishing plan_finishing(double pixels, double seconds, const FinishingRates& rates, bool denoises,
                         const LaterWork& later);

}  // namespace lucerna
