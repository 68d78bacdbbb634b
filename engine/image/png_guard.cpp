#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "engine/base/error.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr std::size_t kSignature = 8, kHead = 8,
                      kCheck = 4;  // bytes: of the file; before and behind a content
constexpr int kPalette = 3;        // a colour type

std::uint32_t word_at(std::string_view bytes, std::size_t at) {
    std::uint32_t word = 0;
    for (const char byte : bytes.substr(at, 4)) word = word << 8 | static_cast<unsigned char>(byte);
    return word;
}

struct Chunk {
    std::string_view type, content;
    std::size_t at = 0;  // from the file's beginning
    // A decoder must know every chunk whose type begins with a capital.
    bool is_critical() const { return (type[0] & 0x20) == 0; }
};

[[noreturn]] void refuse(const Chunk& chunk, std::string_view what) {
    throw InputError(fmt::format("the PNG's chunk{}{} at byte {} {}", chunk.type.empty() ? "" : " ",
                                 chunk.type, chunk.at, what));
}

// Returns the chunk that begins at `at`, and IEND without its content.
Chunk chunk_at(std::string_view png, std::size_t at) {
    Chunk chunk{{}, {}, at};
    if (png.size() < at + kHead) refuse(chunk, "is cut off");
    const std::uint32_t length = word_at(png, at);
    chunk.type = png.substr(at + 4, 4);
    if (length > 0x7FFFFFFF) refuse(chunk, fmt::format("claims {} bytes", length));
    if (chunk.type == "IEND") return chunk;
    if (png.size() < at + kHead + length + kCheck) refuse(chunk, "is cut off");
    chunk.content = png.substr(at + kHead, length);
    const auto* checked = reinterpret_cast<const Bytef*>(chunk.type.data());
    if (chunk.is_critical() && word_at(png, at + kHead + length) != crc32(0, checked, 4 + length))
        refuse(chunk, "is damaged: its checksum differs");
    return chunk;
}

// Returns the colour type.
int check_header(const Chunk& chunk) {
    constexpr std::uint32_t kMostPixels = 1'000'000;  // on a side; libpng's limit
    // For each colour type, bit b: b bits are allowed.
    constexpr std::array<std::uint32_t, 7> kBits{0x10116, 0, 0x10100, 0x116, 0x10100, 0, 0x10100};
    if (chunk.type != "IHDR" || chunk.content.size() != 13) refuse(chunk, "is not the header of a PNG");
    const std::uint32_t width = word_at(chunk.content, 0), height = word_at(chunk.content, 4);
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(chunk.content[i]); };
    const unsigned bits = byte(8), colours = byte(9), packing = byte(10), filter = byte(11),
                   interlace = byte(12);
    // 0 - 1 is larger than the limit, too.
    if (width - 1 >= kMostPixels || height - 1 >= kMostPixels || packing != 0 || filter != 0 ||
        interlace > 1 || colours >= kBits.size() || bits > 16 || (kBits[colours] >> bits & 1) == 0) {
        refuse(chunk,
               fmt::format("has {} x {} pixels of {} bits and colour type {}, which PNG does not allow",
                           width, height, bits, colours));
    }
    return static_cast<int>(colours);
}

// Reads sRGB, gAMA, cHRM [PNG 11.3.3] and cICP, and ignores those of another length.
void read_colours(const Chunk& chunk, PngColours& colours) {
    const std::string_view content = chunk.content;
    const auto share = [&](std::size_t i) { return word_at(content, 4 * i) / 1e5; };
    if (chunk.type == "sRGB" && content.size() == 1) colours.srgb = true;
    if (chunk.type == "gAMA" && content.size() == 4) colours.gamma = share(0);
    if (chunk.type == "cICP" && content.size() == 4)
        colours.coding_points = content[0] != 1 || content[1] != 13;
    if (chunk.type == "cHRM" && content.size() == 32) {  // white comes first
        auto& c = colours.chromaticities.emplace();
        for (std::size_t i = 0; i < 8; ++i) c[(i + 6) % 8] = static_cast<float>(share(i));
    }
}

}  // namespace

PngColours check_png_chunks(const std::filesystem::path& file) {
    const std::vector<std::byte> bytes = read_bytes(file);
    const std::string_view png(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    Chunk chunk = chunk_at(png, kSignature);
    const bool indexed = check_header(chunk) == kPalette;
    const auto next = [&] { return chunk_at(png, chunk.at + kHead + chunk.content.size() + kCheck); };
    bool palette = false, pixels = false;
    PngColours colours;
    for (chunk = next(); chunk.type != "IEND"; chunk = next()) {
        // A decoder ignores those behind the palette or the pixels.
        if (!palette && !pixels) read_colours(chunk, colours);
        if (chunk.type == "IDAT") {
            if (indexed && !palette) refuse(chunk, "is not preceded by a palette");
            pixels = true;
        } else if (chunk.type == "PLTE") {
            // For other colour types the palette is only a hint.
            const std::size_t size = chunk.content.size();
            if (indexed && (palette || pixels)) refuse(chunk, "is out of order");
            if (indexed && (size == 0 || size > 768 || size % 3 != 0))
                refuse(chunk, fmt::format("has {} bytes, which is not a valid palette size", size));
            palette = true;
        } else if (chunk.is_critical()) {
            refuse(chunk, "is of an unknown critical type");
        }
    }
    if (!pixels) throw InputError("the PNG has no pixels");
    return colours;
}

}  // namespace lucerna
