// Compares an image with its reference: error measures, and whether noise explains the difference.
//
// Pixels with a value that is not finite in either image are counted and excluded from every mean, so that a
// NaN neither hides in an average nor spoils it.
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

// Keep the relative error of black pixels finite. The floor of the squared error is (0.01)², so that both
// relative errors change from relative to absolute at the same radiance.
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
    // Root mean square difference of luminance, relative to the reference's luminance (image.h). This is the
    // error that Film::relative_error() estimates. Without R, G and B it uses the first channel.
    double error = 0;
    double mse = 0;           // mean (t - r)²
    double relative_mse = 0;  // mean (t - r)² / (r² + 1e-4)
    double mape = 0;          // mean |t - r| / (|r| + 0.01), a fraction
    std::vector<ChannelComparison> channels;
    LargestDifference largest;
    std::uint64_t pixels = 0;                                // compared
    std::uint64_t masked_pixels = 0;                         // excluded by the mask
    std::uint64_t bad_pixels = 0, bad_reference_pixels = 0;  // with values that are not finite; excluded
    std::vector<std::string> left_out;                       // channels that only one image has
    std::optional<ZTest> z_test;  // if both carry variance.C for every compared channel C
};

// Compares the channels that both images have, except variances and alpha. Throws InputError if the sizes
// differ or no channel is shared; `name` and `reference_name` are for its message. Excludes pixels of which a
// channel of the reference is above `mask_above`, because a few pixels of a visible lamp would dominate all
// means. The z-test treats cells of `z_cell` x `z_cell` pixels as one value (z_test.h).
Comparison compare(const Image& image, const Image& reference, const std::string& name = "image",
                   const std::string& reference_name = "reference",
                   double mask_above = std::numeric_limits<double>::infinity(), int z_cell = 1);

// The functions below find the shared channels and the pixels that can be compared.

// The position in both images of a shared channel. Variances and alpha are not compared, nor depth and layers
// beside R, G and B.
struct SharedChannel {
    std::string name;
    std::size_t at, reference_at;
    std::optional<std::size_t> variance_at, reference_variance_at;  // of "variance." + name
};

// Throws InputError, naming the files, if the sizes differ or no channel is shared.
std::vector<SharedChannel> shared_channels(const Image& image, const Image& reference,
                                           const std::string& name, const std::string& reference_name);

// Returns the channels that only one of the images has.
std::vector<std::string> channels_of_one(const Image& image, const Image& reference);

struct PixelState {
    bool bad = false, bad_reference = false;  // a value that is not finite
    bool masked = false;                      // a channel of the reference is above the mask

    bool compared() const { return !bad && !bad_reference && !masked; }
};
// Returns the state of a pixel, given by pointers to its first values.
PixelState pixel_state(const float* image, const float* reference, const std::vector<SharedChannel>& channels,
                       double mask_above);

// Two images for display in R, G and B, from the channels of these names if both have them, otherwise from
// the first shared channel (Y, or another) repeated. Pixels that are not compared are equal in both: those of
// the reference, or of the image if the reference is not finite, or black.
struct ComparablePair {
    Image image, reference;
    std::vector<bool> compared;  // per pixel
};
// Throws InputError like shared_channels().
ComparablePair comparable_pair(const Image& image, const Image& reference, const std::string& name,
                               const std::string& reference_name, double mask_above);

}  // namespace lucerna
