#include "engine/image/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>

#include "engine/base/error.h"
#include "engine/system/files.h"
#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

using Beginning = std::array<unsigned char, 10>;

// Checks the header and returns the colours that the library does not report. Throws InputError (without the
// file's name) for a header that claims more than the file can hold.
PngColours checked_header(const std::filesystem::path& file, const Beginning& head) {
    constexpr std::array<unsigned char, 4> kExr{0x76, 0x2F, 0x31, 0x01};
    constexpr std::array<unsigned char, 3> kGif{'G', 'I', 'F'};
    constexpr std::array<unsigned char, 8> kPng{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    const auto begins = [&](const auto& with) { return std::equal(with.begin(), with.end(), head.begin()); };
    if (begins(kExr)) check_exr_header(file);
    if (begins(kPng)) return check_png_chunks(file);
    if (begins(kGif)) {
        // The decoder allocates the whole logical screen, whose sides are 16-bit numbers.
        PictureHeader screen;
        screen.width = head[6] | head[7] << 8;
        screen.height = head[8] | head[9] << 8;
        if (!is_credible(file, screen))
            throw InputError(fmt::format("image size {} × {} is not plausible", screen.width, screen.height));
    }
    return {};
}

}  // namespace

OpenedPicture open_picture(const std::filesystem::path& file, PictureUse use) {
    require_readable(file);
    Beginning head{};
    open_to_read(file).read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
    const bool radiance = head[0] == '#' && head[1] == '?';
    const Pictures* formats = radiance ? nullptr : &pictures(file);
    const char* what = use == PictureUse::measurement ? "photograph" : "image";
    try {
        const PngColours png = checked_header(file, head);
        OpenedPicture opened{radiance ? open_radiance(file) : formats->open(file, use), {}, !radiance};
        opened.header = opened.reader->header();
        opened.header.png = png;
        return opened;
    } catch (const std::runtime_error& error) {
        input_error({file.string()}, "not a readable {}: {}", what, one_line(error.what()));
    }
}

bool is_credible(const std::filesystem::path& file, const PictureHeader& header) {
    constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;
    constexpr int kLinesAtOnce = 64;  // decoders allocate so many, even for lower pictures
    if (header.width <= 0 || header.height <= 0 || header.width > kMaxPixels / header.height) return false;
    std::error_code unknown;
    const std::uintmax_t bytes = std::filesystem::file_size(file, unknown);
    const std::int64_t pixels = std::int64_t{header.width} * std::max(header.height, kLinesAtOnce);
    return static_cast<std::uint64_t>(pixels) / kBestCompression <= bytes;
}

const Pictures& pictures(const std::filesystem::path& file,
                         const std::vector<std::filesystem::path>& folders) {
    const Module module{"liblucerna_pictures.so", "lucerna_pictures_4", "pictures need"};
    return *reinterpret_cast<decltype(&lucerna_pictures_4)>(load_module(module, {file.string()}, folders))();
}

}  // namespace lucerna
