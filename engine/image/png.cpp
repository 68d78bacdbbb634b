// Writes pictures for displays.
#include <algorithm>
#include <cstdint>

#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

// Holds the 8-bit values of a picture.
struct Bytes {
    int width, height;
    std::vector<std::uint8_t> rgb;

    PictureToWrite png() const {
        return {PictureFormat::png, PictureUse::colour, width, height, 3, std::span<const std::uint8_t>(rgb)};
    }
};

void write_bytes(const std::filesystem::path& file, const Bytes& bytes) {
    const Pictures* const formats = &pictures(file);
    replace_file(file,
                 [&](const std::filesystem::path& temporary) { formats->write(temporary, bytes.png()); });
}

template <typename Map>
Bytes mapped(const Image& image, Map&& map) {
    std::vector<std::uint8_t> bytes;
    bytes.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 3);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = map(image.rgb_at(x, y));
            for (const float v : {c.x, c.y, c.z}) {
                const float shown = v > 0 ? std::min(v, 1.0F) : 0.0F;  // NaN becomes black
                bytes.push_back(static_cast<std::uint8_t>(shown * 255 + 0.5F));
            }
        }
    }
    return {image.width, image.height, std::move(bytes)};
}

}  // namespace

void write_png(const std::filesystem::path& file, const Image& image, const PictureLook& look) {
    write_bytes(file, mapped(image, Display(look, image.space)));
}

void write_png_display(const std::filesystem::path& file, const Image& image) {
    write_bytes(file, mapped(image, [](const Rgb& c) { return c; }));
}

std::vector<unsigned char> png_bytes(const Image& image) {
    return pictures("picture.png").encode(mapped(image, [](const Rgb& c) { return c; }).png());
}

}  // namespace lucerna
