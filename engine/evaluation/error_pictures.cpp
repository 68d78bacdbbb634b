#include "engine/evaluation/error_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/colour_space.h"
#include "engine/base/spectrum.h"

namespace lucerna {
namespace {

constexpr double kErrorFloor = 0.1;  // of the mean luminance, as in render --error

// Every sixteenth entry of the table of 256; straight lines between them are within 1 % of it.
constexpr std::array<unsigned, 17> kMagma{0x000004, 0x0a0822, 0x1d1147, 0x36106b, 0x51127c, 0x6a1c81,
                                          0x832681, 0x9c2e7f, 0xb73779, 0xd0416f, 0xe75263, 0xf56b5c,
                                          0xfc8961, 0xfea772, 0xfec488, 0xfde2a3, 0xfcfdbf};

Rgb from_hex(unsigned colour) {
    return Rgb(static_cast<float>(colour >> 16 & 255U), static_cast<float>(colour >> 8 & 255U),
               static_cast<float>(colour & 255U)) /
           255.0F;
}

// Linear sRGB of L*, chroma and hue (degrees) of CIE L*a*b*, pulled into the gamut.
Rgb lch_colour(double lightness, double chroma, double hue) {
    const auto cube = [](double t) {
        constexpr double kDelta = 6.0 / 29;
        return t > kDelta ? t * t * t : 3 * kDelta * kDelta * (t - 4.0 / 29);
    };
    const double y = (lightness + 16) / 116;
    const double a = chroma * std::cos(hue * kPiD / 180), b = chroma * std::sin(hue * kPiD / 180);
    const V3d white = rgb_to_xyz(Rgb(1));
    const Rgb c = xyz_to_rgb(V3d(cube(y + a / 500), cube(y), cube(y - b / 200)) * white);
    const auto clamped = [](float v) { return std::clamp(v, 0.0F, 1.0F); };
    return {clamped(c.x), clamped(c.y), clamped(c.z)};
}

double mean_luminance(const Image& image) {
    double sum = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) sum += std::fabs(double{luminance(image.rgb_at(x, y))});
    }
    return sum / (static_cast<double>(image.width) * static_cast<double>(image.height));
}

// of(x, y) over the reference's luminance and floor.
template <typename Of>
Image relative(const Image& reference, Of&& of) {
    const double floor = kErrorFloor * mean_luminance(reference);
    Image result(reference.width, reference.height, {"error"});
    for (int y = 0; y < reference.height; ++y) {
        for (int x = 0; x < reference.width; ++x) {
            const double value = of(x, y);
            const double whole = std::fabs(double{luminance(reference.rgb_at(x, y))}) + floor;
            // A reference that is black everywhere has no scale of its own: any error is without bounds.
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

Rgb diverging_colour(double v) {
    constexpr double kPale = 96, kDark = 30, kChroma = 75;
    const double size = std::isnan(v) ? 0 : std::min(1.0, std::fabs(v));
    const Rgb c =
        lch_colour(kPale + (kDark - kPale) * size, kChroma * std::sin(size * kPiD * 0.7), v < 0 ? 270 : 35);
    return {srgb_encoded(c.x), srgb_encoded(c.y), srgb_encoded(c.z)};
}

Rgb magma_colour(double v) {
    const double at = std::isnan(v) ? 0 : std::clamp(v, 0.0, 1.0) * (kMagma.size() - 1);
    const auto below = std::min<std::size_t>(static_cast<std::size_t>(at), kMagma.size() - 2);
    const float share = static_cast<float>(at - static_cast<double>(below));
    return from_hex(kMagma[below]) * (1 - share) + from_hex(kMagma[below + 1]) * share;
}

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
    const double decade = std::pow(10, std::floor(std::log10(most)));  // most >= 1e-45: > 0
    for (const double step : {1.0, 2.0, 5.0}) {
        if (most <= step * decade) return step * decade;
    }
    return 10 * decade;
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
