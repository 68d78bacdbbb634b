// What two images have in common, and which of their pixels can be compared.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/image.h"

namespace lucerna {

// One channel that both images have: where it is in each. Variances and alpha are not compared.
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

std::optional<std::size_t> find_channel(const Image& image, const std::string& name);

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
struct LookedAt {
    Image image, reference;
    std::vector<bool> compared;  // per pixel
};
// Throws InputError as above.
LookedAt looked_at(const Image& image, const Image& reference, const std::string& name,
                   const std::string& reference_name, double mask_above);

}  // namespace lucerna
