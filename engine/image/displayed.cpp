#include "engine/image/displayed.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "engine/colour/colour_space.h"

namespace lucerna {
namespace {

constexpr double kLargest = double{std::numeric_limits<float>::max()};

// Returns the finite luminances above 0, in no particular order.
std::vector<float> luminances(const Image& image) {
    const V3d weights = (image.space ? *image.space : colour_spaces().front()).luminances();
    std::vector<float> all;
    all.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = image.rgb_at(x, y);
            if (!is_finite(c)) continue;
            const double value = std::min(weights.dot(V3d(c)), kLargest);
            if (value > 0) all.push_back(static_cast<float>(value));
        }
    }
    return all;
}

// Reorders the values and returns all but the largest `share` of them, at least one. The last is the largest.
std::span<float> without_largest(std::span<float> values, double share) {
    const auto kept = static_cast<std::size_t>(std::ceil((1 - share) * static_cast<double>(values.size())));
    const std::size_t last = std::max<std::size_t>(kept, 1) - 1;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(last), values.end());
    return values.first(last + 1);
}

// Returns the factor for which the mean of min(1, factor * value) is `target`, in (0, 1). The mean is a
// concave and piecewise linear function of the factor, so Newton's steps rise to the solution and reach it
// exactly.
double factor_to_mean(std::span<const float> values, double target) {
    const double wanted = target * static_cast<double>(values.size());
    double factor = 0;
    while (true) {
        double sum = 0;
        std::size_t full = 0;
        for (const float value : values) {
            if (factor * double{value} < 1) {
                sum += double{value};
            } else {
                ++full;
            }
        }
        const double next = (wanted - static_cast<double>(full)) / sum;
        if (!(next > factor)) return factor;
        factor = next;
    }
}

}  // namespace

Image displayed(const Image& image, const PictureLook& look) {
    const Display display(look, image.space);
    Image picture = Image::rgb(image.width, image.height);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) picture.set_rgb(x, y, display(image.rgb_at(x, y)));
    }
    return picture;
}

float auto_exposure(const Image& image) {
    constexpr double kMiddleGrey = 0.18, kBright = 0.01, kBlack = 0x1p-12, kGlaring = 0.05;
    std::vector<float> all = luminances(image);
    if (all.empty()) return 1;
    const double black = kBlack * double{without_largest(all, kBright).back()};
    std::erase_if(all, [black](float value) { return double{value} < black; });
    const double factor = factor_to_mean(without_largest(all, kGlaring), kMiddleGrey);
    // The result is a number that a float can hold and divide by, also for images that are nearly black or
    // nearly infinite.
    return static_cast<float>(std::clamp(factor, 0x1p-126, 0x1p126));
}

}  // namespace lucerna
