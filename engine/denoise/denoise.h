// Implements a statistical denoiser that states its error.
//
// An image's samples form two independent halves A and B. Each is filtered by regression on features
// (regression.h) with weights that the other did not influence. D_A, the image made of A, is then independent
// of B, and
//     mean[(D_A - B)² - (A - B)²/2]
// estimates the squared error of D_A, bias included (if both have as many samples). By such estimates the
// filtered and the measured image are mixed locally in the shares that minimise the error [Gu et al. 2022],
// and the error of the result is known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/image/image.h"

namespace lucerna {

// The features of a pixel are means over samples. They describe the first surface that is neither a mirror
// nor clear glass. The channels of a features image are, in this order:
//   albedo.R .G .B   the share of light that is reflected, as seen through mirrors and glass on the way; 1
//                    where a lamp or the sky is seen
//   N.X .Y .Z        shading normal, towards the eye, in the scene's axes; 0 where the sky is seen
//   P.X .Y .Z        position, scene units, relative to Scene::origin()
//   Z                path length from the eye to it, scene units; 0 where the sky is seen
//   Ng.X .Y .Z       geometric normal, in the same axes; 0 where the sky is seen
//   emitter.Y        share of the samples that see a lamp or the sky
enum FeatureChannel : std::uint8_t {
    kAlbedo = 0,
    kNormal = 3,
    kPosition = 6,
    kDepth = 9,
    kGeometricNormal = 10,
    kEmitter = 13,
    kFeatureChannels = 14
};
const std::vector<std::string>& feature_channels();

// The channels of a half are, in this order: R G B, the variances of these means (variance.R .G .B) as if
// samples were independent, and the number of samples.
enum HalfChannel : std::uint8_t { kLight = 0, kVariance = 3, kSamples = 6, kHalfChannels = 7 };
const std::vector<std::string>& half_channels();

// Holds the denoiser's input; all images have the same size.
struct DenoiserInput {
    std::array<Image, 2> halves;
    Image features;
};

// These precede the names of a half's channels in an image with other channels.
inline constexpr const char* kHalfNames[2] = {"first.", "second."};
// Adds the layers as channels of an image, those of the halves with the prefixes kHalfNames.
void add_denoiser_input(Image& image, const DenoiserInput& layers);
// Extracts the layers. Throws InputError that names `file` and the first missing channel. `layer` is empty,
// or the layer or light group whose halves are meant, with a dot at its end: for "lightgroup.stage." they
// begin with first.lightgroup.stage.R.
DenoiserInput denoiser_input_of(const Image& image, const std::string& file, const std::string& layer = "");

struct Denoised {
    Image image;            // R G B
    double relative_error;  // of the image, as in Film::ErrorEstimate, but bias included
    // Says whether the error is worth stating. It is not if halves have fewer than two samples per pixel, or
    // if the standard error of the mean squared error exceeds a quarter of that mean.
    bool error_is_known;
};

// Returns the same result for any number of threads. A crop's result differs from that of the whole image
// only by the influence of its surroundings.
Denoised denoise(const DenoiserInput& layers, const Workers& workers);

// Estimates the peak memory in bytes per pixel.
inline constexpr std::size_t kDenoiserBytesPerPixel = 400;

}  // namespace lucerna
