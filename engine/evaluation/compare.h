// How far an image is from its reference: numbers, and whether noise explains them.
//
// Pixels with a value that is not finite, in either image, are counted and left out of every mean: one NaN
// must neither hide in an average nor spoil it.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/vec.h"
#include "engine/evaluation/z_test.h"
#include "engine/image/image.h"

namespace lucerna {

// Keeps the relative error of black pixels finite; (0.01)², so that the relative square and the relative
// absolute error turn over at the same radiance.
inline constexpr double kRelativeMseFloor = 1e-4;
inline constexpr double kMapeFloor = 1e-2;

struct ChannelComparison {
    std::string name;
    double mean = 0, reference_mean = 0;
    std::optional<double> ratio;  // mean / reference_mean; none if the reference is black
};

struct LargestDifference {
    double value = 0;  // |t - r|
    int x = 0, y = 0;
    std::string channel;
};

struct Comparison {
    // The root of the mean square of luminance's difference, relative to r's luminance (image.h): what
    // Film::relative_error() estimates. Of the first channel where there is no R, G and B.
    double error = 0;
    double mse = 0;           // mean (t - r)²
    double relative_mse = 0;  // mean (t - r)² / (r² + 1e-4)
    double mape = 0;          // mean |t - r| / (|r| + 0.01), a share of 1
    std::vector<ChannelComparison> channels;
    LargestDifference largest;
    std::uint64_t pixels = 0;                                // compared
    std::uint64_t masked_pixels = 0;                         // left out as asked for
    std::uint64_t bad_pixels = 0, bad_reference_pixels = 0;  // with a value that is not finite; not compared
    std::vector<std::string> left_out;                       // channels that only one image has
    std::optional<ZTest> z_test;  // if both carry variance.C for every compared channel C
};

// Compares the channels that both images have, but not variances and alpha. Throws InputError if the sizes
// differ or no channel is shared; `name` and `reference_name` are for its message. Pixels of which a compared
// channel of the reference is above `mask_above` are left out: a few of a lamp that is seen would decide all
// means. The z-test takes cells of `z_cell` x `z_cell` pixels for one value (z_test.h).
Comparison compare(const Image& image, const Image& reference, const std::string& name = "image",
                   const std::string& reference_name = "reference",
                   double mask_above = std::numeric_limits<double>::infinity(), int z_cell = 1);

// What two images have in common, and which of their pixels can be compared.

// One channel that both images have: where it is in each. Variances and alpha are not compared, nor depth and
// layers beside R, G and B.
struct SharedChannel {
    std::string name;
    std::size_t at, reference_at;
    std::optional<std::size_t> variance_at, reference_variance_at;  // of "variance." + name
};

// Throws InputError, naming the files, if the sizes differ or no channel is shared.
std::vector<SharedChannel> shared_channels(const Image& image, const Image& reference,
                                           const std::string& name, const std::string& reference_name);

// The channels that only one of the two has.
std::vector<std::string> channels_of_one(const Image& image, const Image& reference);

struct PixelState {
    bool bad = false, bad_reference = false;  // a value that is not finite
    bool masked = false;                      // a channel of the reference is above the mask

    bool compared() const { return !bad && !bad_reference && !masked; }
};
// Of one pixel, given by its first values.
PixelState pixel_state(const float* image, const float* reference, const std::vector<SharedChannel>& channels,
                       double mask_above);

// Two images to be looked at, in R, G and B: of the channels of these names if both have them, else of the
// first channel that both have (Y, or another), three times. Pixels that are not compared are alike in both:
// as in the reference, or as in the image where the reference is not finite, or black.
struct ComparablePair {
    Image image, reference;
    std::vector<bool> compared;  // per pixel
};
// Throws InputError as above.
ComparablePair comparable_pair(const Image& image, const Image& reference, const std::string& name,
                               const std::string& reference_name, double mask_above);

}  // namespace lucerna
