// Writes pictures for displays, by libpng: OpenImageIO (engine/image/pictures.h) takes a quarter of a second
// to load.
#include <png.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

// Returns the bytes of a PNG file of 8-bit sRGB values, row by row from the top. Throws InputError where PNG
// or libpng allows no such size.
std::vector<unsigned char> encoded(int width, int height, const std::vector<std::uint8_t>& rgb) {
    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    header.width = static_cast<png_uint_32>(width), header.height = static_cast<png_uint_32>(height);
    header.format = PNG_FORMAT_RGB;
    header.flags = PNG_IMAGE_FLAG_FAST;  // takes less time, and up to half as many bytes again
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
    std::vector<unsigned char> bytes(size);
    if (png_image_write_to_memory(&header, bytes.data(), &size, 0, rgb.data(), 0, nullptr) == 0)
        input_error({}, "a picture of {} x {} pixels cannot be written as PNG: {}", width, height,
                    std::data(header.message));
    bytes.resize(size);
    return bytes;
}

void write_bytes(const std::filesystem::path& file, const std::vector<unsigned char>& bytes) {
    const std::array parts{std::as_bytes(std::span(bytes))};
    replace_file(file, parts);
}

template <typename Map>
std::vector<unsigned char> mapped(const Image& image, const Workers& workers, Map&& map) {
    const std::size_t row_bytes = static_cast<std::size_t>(image.width) * 3;
    std::vector<std::uint8_t> bytes(row_bytes * static_cast<std::size_t>(image.height));
    parallel_chunks(workers.alone(), image.height, [&](std::int64_t row) {
        std::uint8_t* to = &bytes[static_cast<std::size_t>(row) * row_bytes];
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = map(image.rgb_at(x, static_cast<int>(row)));
            for (const float v : {c.x, c.y, c.z}) {
                const float shown = v > 0 ? std::min(v, 1.0F) : 0.0F;  // NaN becomes black
                *to++ = static_cast<std::uint8_t>(shown * 255 + 0.5F);
            }
        }
    });
    return encoded(image.width, image.height, bytes);
}

}  // namespace

void write_png(const std::filesystem::path& file, const Image& image, const PictureLook& look,
               const Workers& workers) {
    write_bytes(file, mapped(image, workers, Display(look, image.space)));
}

void write_png_display(const std::filesystem::path& file, const Image& image) {
    write_bytes(file, mapped(image, Workers{1}, [](const Rgb& c) { return c; }));
}

std::vector<unsigned char> png_bytes(const Image& image) {
    return mapped(image, Workers{1}, [](const Rgb& c) { return c; });
}

}  // namespace lucerna
