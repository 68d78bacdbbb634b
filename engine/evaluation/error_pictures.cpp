#include "engine/evaluation/error_pictures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/figures/colour_maps.h"
#include "engine/figures/false_colour.h"

namespace lucerna {
namespace {

constexpr double kErrorFloor = 0.1;  // of the mean luminance, as in render --error

double mean_luminance(const Image& image) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sum += std::fabs(double{luminance(image.rgb_at(x, y))});
    }
    return sum / (static_cast<double>(image.width) * static_cast<double>(image.height));
}

// Divides of(x, y) by the reference's luminance plus a floor.
template <typename Of>
Image relative(const Image& reference, Of&& of) {
    const double floor = kErrorFloor * mean_luminance(reference);
    Image result(reference.width, reference.height, {"error"});
    for (int y = 0; y < reference.height; ++y) {
        for (int x = 0; x < reference.width; ++x) {
            const double value = of(x, y);
            const double whole = std::fabs(double{luminance(reference.rgb_at(x, y))}) + floor;
            // If the reference is black everywhere, any error is unbounded.
            constexpr double kMost = std::numeric_limits<float>::max();
            if (value != 0)
                result.value(x, y, 0) = static_cast<float>(
                    whole > 0 ? std::clamp(value / whole, -kMost, kMost) : std::copysign(kMost, value));
        }
    }
    return result;
}

template <typename Colour>
Image coloured(const Image& values, double scale, Colour&& colour) {
    Image picture = Image::rgb(values.width, values.height);
    for (int y = 0; y < values.height; ++y) {
        for (int x = 0; x < values.width; ++x)
            picture.set_rgb(x, y, colour(double{values.value(x, y, 0)} / scale));  // scale > 0
    }
    return picture;
}

}  // namespace

Image relative_error(const Image& image, const Image& reference) {
    return relative(reference, [&](int x, int y) {
        return double{luminance(image.rgb_at(x, y))} - double{luminance(reference.rgb_at(x, y))};
    });
}

Image relative_to(const Image& value, const Image& reference) {
    return relative(reference, [&](int x, int y) { return double{luminance(value.rgb_at(x, y))}; });
}

double error_scale(const Image& one_channel) {
    std::vector<double> sizes;
    for (const float v : one_channel.data) sizes.push_back(std::fabs(double{v}));
    const double most = level(std::move(sizes), 0.98);
    if (!(most > 0)) return 1;
    return round_step_from(most).value();
}

Image diverging_picture(const Image& one_channel, double scale) {
    return coloured(one_channel, scale, diverging_colour);
}

Image magma_picture(const Image& one_channel, double scale) {
    return coloured(one_channel, scale, magma_colour);
}

Image radiance_picture(const Image& image) {
    Image picture = Image::rgb(image.width, 2 * image.height);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = image.rgb_at(x, y);
            const float most = max_component(c);
            if (!is_finite(c) || most >= 0x1p126F) {
                picture.set_rgb(x, y + image.height, Rgb(1));
                continue;
            }
            if (!(most > 0x1p-127F)) continue;  // black
            int exponent = 0;
            std::frexp(most, &exponent);  // most < 2^exponent
            const float scale = std::ldexp(1.0F, -exponent);
            const auto mantissa = [&](float v) {
                return std::floor(std::min(255.0F, std::max(0.0F, v * scale) * 256)) / 255;
            };
            picture.set_rgb(x, y, {mantissa(c.x), mantissa(c.y), mantissa(c.z)});
            picture.set_rgb(x, y + image.height, Rgb(static_cast<float>(exponent + 128) / 255));
        }
    }
    return picture;
}

Image contact_sheet(int count, int columns, const V2i& size, int gap,
                    const std::function<void(int i, Image& sheet, int x, int y)>& paint) {
    const int across = std::min(count, columns), down = (count + columns - 1) / columns;
    Image sheet = Image::rgb(across * (size.x + gap) - gap, down * (size.y + gap) - gap);
    constexpr float kGrey = 0.05F;
    std::fill(sheet.data.begin(), sheet.data.end(), kGrey);
    for (int i = 0; i < count; ++i)
        paint(i, sheet, i % columns * (size.x + gap), i / columns * (size.y + gap));
    return sheet;
}

Image shrunk(const Image& image, int factor) {
    if (factor <= 1) return image;
    Image small = Image::rgb((image.width + factor - 1) / factor, (image.height + factor - 1) / factor);
    for (int y = 0; y < small.height; ++y) {
        for (int x = 0; x < small.width; ++x) {
            Rgb sum(0);
            int count = 0;
            for (int j = y * factor; j < std::min(image.height, (y + 1) * factor); ++j) {
                for (int i = x * factor; i < std::min(image.width, (x + 1) * factor); ++i, ++count)
                    sum += image.rgb_at(i, j);
            }
            small.set_rgb(x, y, sum / static_cast<float>(count));  // every block holds at least one pixel
        }
    }
    return small;
}

double level(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[static_cast<std::size_t>(at)];
}

}  // namespace lucerna
