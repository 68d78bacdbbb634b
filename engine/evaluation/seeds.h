// Several renders of one scene that differ in nothing but their seed, and a reference: what of their error is
// bias, which more time does not mend, and what is noise, which it does.
//
// With d_i the error of image i, weighted and averaged over all pixels and channels as G_ij = mean(w d_i
// d_j):
//   mean square error   mean of G_ii
//   bias²               mean of G_ij, i ≠ j: the noise of two seeds is independent and falls out, so that no
//   noise
//                       of the mean is left in it (it may come out below 0 where there is no bias)
//   noise²              their difference: the variance of one image
// The reference's own noise is in every d_i alike and would count as bias: its variance, if it carries one,
// is taken off; samples that are stratified state more noise than they have, so that this may be too much:
// what bias² is with that noise left in is told, too, and the truth lies between the two. Standard errors are
// those of a jackknife over the seeds [Efron and Stein 1981: rather too large than too small], so errors that
// hang together across an image, as those of photon maps do, are no matter; bias² adds what the reference's
// noise does to it, taken as independent from pixel to pixel.
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
    std::optional<double> error;  // standard error; none of too few seeds
};

// Of squared errors: with w = 1 in the image's unit squared, or relative with w = 1/(r² + kRelativeMseFloor).
struct ErrorParts {
    Estimate mse;                 // of one image, as it is
    Estimate bias2;               // three seeds give it a standard error
    Estimate noise2;              // of one image
    double reference_noise2 = 0;  // taken off bias2; 0 if the reference does not say
};

struct ChannelOfSeeds {
    std::string name;
    Estimate mean;
    double reference_mean = 0;
    std::optional<Estimate>
        ratio;  // to the reference's, whose noise is not in the error; none if that is black
};

struct BiasAndNoise {
    std::size_t images = 0;
    std::uint64_t pixels = 0;  // finite in all images and in the reference, and not masked
    ErrorParts absolute, relative;
    std::vector<ChannelOfSeeds> channels;
    bool reference_has_variance = false;
    // Mean variance that the images state over the one between them: 1 if they tell the truth. None if they
    // state none or do not differ.
    std::optional<double> stated_over_actual;
    // Pairs of images with the same value in every pixel: seeds that are not different, or no noise at all.
    std::uint64_t equal_pairs = 0;
};

struct NamedImage {
    std::string name;  // for messages
    Image image;
};

// Throws InputError, naming the image, if there are fewer than two or as compare() does. `mask_above` as
// there.
BiasAndNoise bias_and_noise(std::span<const NamedImage> images, const NamedImage& reference,
                            double mask_above = std::numeric_limits<double>::infinity());

// Channel by channel, of the channels of the first; "variance.C" becomes the variance of the mean of
// independent images. One image is its own mean. Throws InputError, naming the image, if one lacks a channel
// or has another size.
Image mean_image(std::span<const NamedImage> images);

// The standard deviation between the images, per channel that is not a variance. At least two images, as
// above.
Image noise_image(std::span<const NamedImage> images);

}  // namespace lucerna
