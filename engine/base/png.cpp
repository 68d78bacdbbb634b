// Display pictures.
#include <algorithm>
#include <cstdint>

#include "engine/base/files.h"
#include "engine/base/image.h"
#include "engine/base/pictures.h"

namespace lucerna {
namespace {

// Luminance above this share of white is rolled off; below it the picture is exact.
constexpr float kKnee = 0.8F;

// 1 in the limit; continuous with slope 1 at the knee.
float roll_off(float y) {
    if (y <= kKnee) return y;
    const float over = (y - kKnee) / (1 - kKnee);
    return kKnee + (1 - kKnee) * (over / (1 + over));
}

// Compresses luminance and, where a saturated colour still leaves the gamut, pulls it towards grey instead of
// clipping one channel, which would turn its hue.
Rgb tone_map(Rgb c) {
    c = {std::max(0.0F, c.x), std::max(0.0F, c.y), std::max(0.0F, c.z)};
    const float y = luminance(c);
    if (!(y > 0)) return Rgb(0);  // NaN components are 0 by now
    if (!std::isfinite(y)) return Rgb(1);
    const float target = roll_off(y);
    c *= target / y;  // y > 0 was just checked
    const float top = max_component(c);
    if (top > 1) {
        const float keep = (1 - target) / (top - target);  // top > 1 > target
        c = Rgb(target) + keep * (c - Rgb(target));
    }
    return c;
}

float srgb_encode(float x) {
    return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
}

// Eight-bit values of a picture.
struct Bytes {
    int width, height;
    std::vector<std::uint8_t> rgb;

    PictureToWrite png() const {
        return {PictureFormat::png, PictureUse::colour, width, height, 3, std::span<const std::uint8_t>(rgb)};
    }
};

void write_bytes(const std::filesystem::path& file, const Bytes& bytes) {
    const Pictures& formats = pictures(file);
    replace_file(file,
                 [&](const std::filesystem::path& temporary) { formats.write(temporary, bytes.png()); });
}

template <typename Map>
Bytes mapped(const Image& image, Map&& map) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = map(image.rgb_at(x, y));
            for (const float v : {c.x, c.y, c.z}) {
                const float shown = v > 0 ? std::min(v, 1.0F) : 0.0F;  // NaN is black, not undefined
                bytes.push_back(static_cast<std::uint8_t>(shown * 255 + 0.5F));
            }
        }
    }
    return {image.width, image.height, std::move(bytes)};
}

}  // namespace

Rgb display_colour(const Rgb& exposed) {
    const Rgb c = tone_map(exposed);
    return {srgb_encode(c.x), srgb_encode(c.y), srgb_encode(c.z)};
}

void write_png(const std::filesystem::path& file, const Image& image, float exposure) {
    if (image.space) return write_png(file, brought_to_srgb(image, true), exposure);
    write_bytes(file,
                mapped(image, [&](const Rgb& radiance) { return display_colour(radiance * exposure); }));
}

void write_png_display(const std::filesystem::path& file, const Image& image) {
    write_bytes(file, mapped(image, [](const Rgb& c) { return c; }));
}

std::vector<unsigned char> png_bytes(const Image& image) {
    return pictures("picture.png").encode(mapped(image, [](const Rgb& c) { return c; }).png());
}

float auto_exposure(const Image& image) {
    if (image.space) return auto_exposure(brought_to_srgb(image, true));
    double log_sum = 0;
    std::size_t lit = 0;
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const float value = luminance(image.rgb_at(x, y));
            if (!(value > 0) || !std::isfinite(value)) continue;
            log_sum += std::log(static_cast<double>(value));
            ++lit;
        }
    }
    if (lit == 0) return 1;
    constexpr double kMiddleGrey = 0.18;
    return static_cast<float>(kMiddleGrey / std::exp(log_sum / static_cast<double>(lit)));
}

}  // namespace lucerna
