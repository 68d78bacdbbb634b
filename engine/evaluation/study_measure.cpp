#include "engine/evaluation/study_measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/error_scale.h"
#include "engine/evaluation/compare.h"
#include "engine/evaluation/shared_channels.h"

namespace lucerna {
namespace {

constexpr std::array<const char*, 3> kVariances{"variance.R", "variance.G", "variance.B"};

bool states_variances(const Image& image) {
    return std::all_of(kVariances.begin(), kVariances.end(),
                       [&](const char* name) { return find_channel(image, name).has_value(); });
}

// Luminance and, where the image states it, its variance. Channels are taken to vary together, as in Film.
Image luminance_image(const Image& image) {
    const bool variances = states_variances(image);
    Image result(image.width, image.height,
                 variances ? std::vector<std::string>{"Y", "variance.Y"} : std::vector<std::string>{"Y"});
    std::array<int, 3> at{};
    for (std::size_t c = 0; variances && c < 3; ++c)
        at[c] = static_cast<int>(*find_channel(image, kVariances[c]));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            result.value(x, y, 0) = luminance(image.rgb_at(x, y));
            if (!variances) continue;
            const auto sigma = [&](std::size_t c) { return std::sqrt(image.value(x, y, at[c])); };
            const float whole = luminance(Rgb(sigma(0), sigma(1), sigma(2)));
            result.value(x, y, 1) = whole * whole;
        }
    }
    return result;
}

// Mean of variance / (r² + kRelativeMseFloor) where r is a number; 0 if the image states no variance.
double relative_variance(const Image& reference) {
    if (reference.channels.size() < 2) return 0;
    double sum = 0, pixels = 0;
    for (std::size_t i = 0; i < reference.data.size(); i += 2) {
        const double r = double{reference.data[i]}, variance = double{reference.data[i + 1]};
        if (!std::isfinite(r) || !std::isfinite(variance)) continue;
        sum += variance / (r * r + kRelativeMseFloor);
        ++pixels;
    }
    return pixels > 0 ? sum / pixels : 0;
}

}  // namespace

StudyMeasure::StudyMeasure(const NamedImage& reference, double mask_above)
    : reference_{reference.name, luminance_image(reference.image)} {
    const auto channels = shared_channels(reference.image, reference.image, reference.name, reference.name);
    Image& seen = reference_.image;
    double sum = 0, pixels = 0;
    for (int y = 0; y < seen.height; ++y) {
        for (int x = 0; x < seen.width; ++x) {
            const float* values = &reference.image.data[reference.image.index(x, y)];
            if (pixel_state(values, values, channels, mask_above).compared()) {
                sum += std::fabs(double{seen.value(x, y, 0)});
                ++pixels;
            } else {
                seen.value(x, y, 0) = std::numeric_limits<float>::quiet_NaN();
            }
        }
    }
    const double mean = pixels > 0 ? sum / pixels : 0;
    // compare() adds a number to r². Scaled, that number is the share of the mean, squared.
    scale_ = std::sqrt(kRelativeMseFloor) / (kErrorFloorShare * mean);
    if (!(mean > 0) || !std::isfinite(scale_)) {
        throw InputError({reference.name}, fmt::format("the reference is black in all {} pixels that are "
                                                       "compared: no error is relative to that",
                                                       pixels));
    }
    reference_ = scaled(reference_);
    noise2_ = relative_variance(seen);
}

// `image`: of luminance. In double: the scale of a very dim or bright scene is beyond float32.
NamedImage StudyMeasure::scaled(const NamedImage& image) const {
    NamedImage result = image;
    for (std::size_t i = 0; i < result.image.data.size(); ++i) {
        const bool variance = result.image.channels.size() == 2 && i % 2 == 1;
        result.image.data[i] =
            static_cast<float>(double{result.image.data[i]} * (variance ? scale_ * scale_ : scale_));
    }
    return result;
}

void StudyMeasure::measure(const std::vector<NamedImage>& images, StudyResult& result,
                           Monitor& monitor) const {
    std::vector<NamedImage> seen;
    for (const NamedImage& one : images) seen.push_back(scaled({one.name, luminance_image(one.image)}));

    result.reference_noise2 = noise2_;
    double squares = 0;
    for (const NamedImage& one : seen) {
        const Comparison numbers = compare(one.image, reference_.image, one.name, reference_.name);
        squares += numbers.relative_mse / static_cast<double>(seen.size());
        if (numbers.bad_pixels > 0) {
            monitor.warn(fmt::format("{}: {} pixels are not finite and are left out of every error", one.name,
                                     numbers.bad_pixels));
        }
        if (seen.size() == 1) result.mean_ratio = numbers.channels.at(0).ratio.value_or(1);
    }
    result.error2 = squares;
    if (seen.size() == 1) return;
    const BiasAndNoise parts = bias_and_noise(seen, reference_);
    result.error2 = parts.relative.mse.value;
    result.error2_error = parts.relative.mse.error;
    result.bias2 = parts.relative.bias2;
    result.noise2 = parts.relative.noise2;
    const auto& ratio = parts.channels.at(0).ratio;
    result.mean_ratio = ratio ? ratio->value : 1;
}

}  // namespace lucerna
