// Textures. Images of any format come in through OpenImageIO, here only.
#include "engine/world/texture.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/files.h"

namespace lucerna {
namespace {

float srgb_decode(float x) {
    return x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F);
}

// The place within a repeat, [0,1); 0 where the coordinate has none (not finite).
float fraction(float x) {
    const float within = x - std::floor(x);
    return within >= 0 && within < 1 ? within : 0.0F;  // 1: a tiny negative x, rounded
}

bool is_odd(float x) {
    return std::fmod(std::floor(x), 2.0F) != 0;
}

// The two texels between whose centres x = [0,1) lies, and how far beyond the first.
struct Between {
    int first, second;
    float share;  // of the second
};
Between between(float x, int n) {
    const float place = x * static_cast<float>(n) - 0.5F;
    const float below = std::floor(place);  // -1 ... n-1
    const int first = static_cast<int>(below);
    return {first < 0 ? n - 1 : first, first + 1 < n ? first + 1 : 0, place - below};
}

Rgb bilinear(const Image& image, float u, float v) {
    const Between x = between(fraction(u), image.width);
    const Between y = between(fraction(-v), image.height);  // rows run down
    const auto row = [&](int at) {
        return image.rgb_at(x.first, at) * (1 - x.share) + image.rgb_at(x.second, at) * x.share;
    };
    return row(y.first) * (1 - y.share) + row(y.second) * y.share;
}

// Pixels as they are stored, up to three channels of them.
struct Stored {
    int width, height, channels;
    bool encoded;  // sRGB
    std::vector<float> pixels;
};

Stored read_stored(const std::filesystem::path& file) {
    require_readable(file);
    OIIO::ImageSpec how;
    how.attribute("oiio:UnassociatedAlpha",
                  1);  // alpha is left out, and must not darken the colours before that
    const auto in = OIIO::ImageInput::open(file.string(), &how);
    if (!in) throw InputError({file.string()}, "not a readable image: " + one_line(OIIO::geterror()));
    const OIIO::ImageSpec& spec = in->spec();
    // A lying header must not make us allocate what the machine does not have.
    constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
    if (spec.width <= 0 || spec.height <= 0 || spec.width > kMaxPixels / spec.height) {
        throw InputError({file.string()},
                         fmt::format("image size {} × {} is not credible", spec.width, spec.height));
    }
    if (spec.nchannels < 1) throw InputError({file.string()}, "the image has no channels");

    Stored stored{spec.width, spec.height, spec.nchannels < 3 ? 1 : 3, !spec.format.is_floating_point(), {}};
    stored.pixels.resize(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.height) *
                         static_cast<std::size_t>(stored.channels));
    if (!in->read_image(0, 0, 0, stored.channels, OIIO::TypeDesc::FLOAT, stored.pixels.data())) {
        throw InputError({file.string()}, "not a readable image: " + one_line(in->geterror()));
    }
    return stored;
}

}  // namespace

RgbTexture RgbTexture::constant(const Rgb& value) {
    RgbTexture texture;
    texture.a_ = value;
    return texture;
}

RgbTexture RgbTexture::checkerboard(const Rgb& even, const Rgb& odd, const V2f& scale) {
    RgbTexture texture;
    texture.kind_ = Kind::checkerboard;
    texture.a_ = even;
    texture.b_ = odd;
    texture.scale_ = scale;
    return texture;
}

RgbTexture RgbTexture::image(std::shared_ptr<const Image> image, const V2f& scale) {
    assert(image && image->width > 0 && image->height > 0);
    RgbTexture texture;
    texture.kind_ = Kind::image;
    texture.image_ = std::move(image);
    texture.scale_ = scale;
    return texture;
}

Rgb RgbTexture::at(const TexturePoint& point) const {
    const V2f at = point.uv * scale_;
    switch (kind_) {
        case Kind::constant:
            return a_;
        case Kind::checkerboard:
            return is_odd(at.x) == is_odd(at.y) ? a_ : b_;
        case Kind::image:
            return bilinear(*image_, at.x, at.y);
    }
    return a_;
}

std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file) {
    const Stored stored = read_stored(file);
    auto image = std::make_shared<Image>(Image::rgb(stored.width, stored.height));
    const auto channels = static_cast<std::size_t>(stored.channels);
    for (std::size_t i = 0; i < image->data.size(); ++i) {
        const float value = stored.pixels[i / 3 * channels + (channels == 3 ? i % 3 : 0)];
        if (!(value >= 0) || !std::isfinite(value)) {
            const std::size_t x = i / 3 % static_cast<std::size_t>(stored.width);
            const std::size_t y = i / 3 / static_cast<std::size_t>(stored.width);
            throw InputError(
                {file.string()},
                fmt::format("pixel ({}, {}) holds {}; accepted: finite values, not negative", x, y, value));
        }
        image->data[i] = stored.encoded ? srgb_decode(value) : value;
    }
    return image;
}

}  // namespace lucerna
