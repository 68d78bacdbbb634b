// Separates the error of several renders of one scene, which differ only in their seed, into bias, which
// persists, and noise, which decreases with time.
//
// Let d_i be the error of image i and G_ij = mean(w d_i d_j) a weighted mean over all pixels and channels:
//   mean square error   mean of G_ii
//   bias²               mean of G_ij, i ≠ j, where the independent noise of two seeds cancels
//                       (the estimate may be below 0 if there is no bias)
//   noise²              their difference, the variance of one image
// The reference's own noise is common to all d_i and would count as bias, so its variance is subtracted if
// the reference states it. Stratified samples state more noise than they have, which subtracts too much;
// bias² without the subtraction is therefore reported, too, and the truth lies between both. Standard errors
// come from a jackknife over the seeds [Efron and Stein 1981: rather too large than too small], so correlated
// errors within an image, as in photon maps, do no harm. The error of bias² includes the reference's noise,
// taken as independent between pixels.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/image/image.h"

namespace lucerna {

struct Estimate {
    double value = 0;
    std::optional<double> error;  // standard error; none for too few seeds
};

// Squared errors, either absolute (w = 1) or relative (w = 1/(r² + kRelativeMseFloor)).
struct ErrorParts {
    Estimate mse;                 // of one image
    Estimate bias2;               // has a standard error from three seeds on
    Estimate noise2;              // of one image
    double reference_noise2 = 0;  // subtracted from bias2; 0 if the reference does not state it
};

struct ChannelOfSeeds {
    std::string name;
    Estimate mean;
    double reference_mean = 0;
    std::optional<Estimate> ratio;  // to the reference's mean without its noise; none if that is black
};

struct BiasAndNoise {
    std::size_t images = 0;
    std::uint64_t pixels = 0;  // finite in all images and in the reference, and not masked
    ErrorParts absolute, relative;
    std::vector<ChannelOfSeeds> channels;
    bool reference_has_variance = false;
    // Mean variance that the images state over the one between them, 1 for correct statements. None if they
    // state none or are equal.
    std::optional<double> stated_over_actual;
    // Pairs of images that are equal in every pixel, because of equal seeds or absence of noise.
    std::uint64_t equal_pairs = 0;
};

struct NamedImage {
    std::string name;  // for messages
    Image image;
};

// Throws InputError, naming the image, for fewer than two images or in the cases of compare(), which also
// explains `mask_above`.
BiasAndNoise bias_and_noise(std::span<const NamedImage> images, const NamedImage& reference,
                            double mask_above = std::numeric_limits<double>::infinity());

// Averages the channels of the first image; "variance.C" becomes the variance of the mean of independent
// images. Accepts a single image. Throws InputError, naming the image, if one lacks a channel or has another
// size.
Image mean_image(std::span<const NamedImage> images);

// Returns the standard deviation between at least two images, per channel that is not a variance. Throws like
// mean_image().
Image noise_image(std::span<const NamedImage> images);

}  // namespace lucerna
