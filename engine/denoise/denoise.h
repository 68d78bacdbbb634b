// A statistical denoiser that states its error.
//
// An image's samples are in two halves A and B that do not depend on each other. Each is filtered by weights
// that the other had no part in. D_A, what is made of A, is then independent of B, and
//     mean[(D_A - B)² - (A - B)²/2]
// estimates the squared error of D_A, its bias included (where both have as many samples). By such estimates
// the filtered image and the measured one are mixed, everywhere in the shares that make the error least [Gu
// et al. 2022], and the error of what is written is known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/image/image.h"

namespace lucerna {

// What is known of a pixel beside its light, as means over samples: the first surface that is neither a
// mirror nor clear glass. The order of a features image's channels:
//   albedo.R .G .B   the share of light that is sent back, as seen through mirrors and glass on the way; 1
//                    where a lamp or the sky is seen
//   N.X .Y .Z        shading normal, towards the eye, in the scene's axes; 0 where the sky is seen
//   P.X .Y .Z        position, scene units, relative to Scene::origin()
//   Z                length of the way to it, scene units; 0 where the sky is seen
//   Ng.X .Y .Z       the surface's own normal, likewise
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

// The order of a half's channels: R G B, the variances of these means (variance.R .G .B) as if samples did
// not depend on each other, and the number of samples.
enum HalfChannel : std::uint8_t { kLight = 0, kVariance = 3, kSamples = 6, kHalfChannels = 7 };
const std::vector<std::string>& half_channels();

// All of one size.
struct Layers {
    std::array<Image, 2> halves;
    Image features;
};

// Before the names of a half's channels, in an image beside others.
inline constexpr const char* kHalfNames[2] = {"first.", "second."};
// The same as channels of an image beside others: "first." and "second." before a half's names.
void add_layers(Image& image, const Layers& layers);
// Throws InputError that names `file` and the first channel that is missing. `layer`: empty, or that whose
// halves are meant, with a dot at its end: of "lightgroup.stage." they begin with first.lightgroup.stage.R.
Layers layers_of(const Image& image, const std::string& file, const std::string& layer = "");

struct Denoised {
    Image image;            // R G B
    double relative_error;  // of it, as Film::ErrorEstimate has it, but with bias
    // Whether that is worth a statement. It is not where halves have fewer than two samples per pixel, and
    // where the standard error of the mean of the squared errors is more than a quarter of that mean.
    bool error_is_known;
};

// The same for any number of threads; of a part of an image, but for what lies about it, as of the whole.
Denoised denoise(const Layers& layers, const Workers& workers);

// What that takes at the most, and about how long, on a machine of today: bytes and seconds for each pixel,
// seconds of one thread.
inline constexpr std::size_t kDenoiserBytesPerPixel = 640;
inline constexpr double kDenoiserSecondsPerPixel = 12e-6;

}  // namespace lucerna
