#include "engine/image/pictures.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/system/files.h"

namespace lucerna {
namespace {

constexpr std::uint32_t kMostBytes = 0x7FFFFFFF;  // of a chunk
constexpr int kPalette = 3;                       // the kind of colours

std::uint32_t word_at(const unsigned char* p) {
    return std::uint32_t{p[0]} << 24 | std::uint32_t{p[1]} << 16 | std::uint32_t{p[2]} << 8 | p[3];
}

struct Chunk {
    std::string type;
    std::uint32_t length = 0;
    std::int64_t at = 0;  // of its length, from the file's beginning
    // What a decoder may not leave out begins with a capital.
    bool is_critical() const { return (type[0] & 0x20) == 0; }
};

class Chunks {
  public:
    explicit Chunks(const std::filesystem::path& file) : in_(open_to_read(file)) { in_.seekg(kSignature); }

    Chunk next() {
        Chunk chunk;
        chunk.at = in_.tellg();
        std::array<unsigned char, 8> head{};
        take(head.data(), head.size(), chunk);
        chunk.length = word_at(head.data());
        chunk.type.assign(head.begin() + 4, head.end());
        check_ = crc32(0, head.data() + 4, 4);
        if (chunk.length > kMostBytes) refuse(chunk, fmt::format("claims {} bytes", chunk.length));
        return chunk;
    }
    // Over the content; `head` gets its first bytes.
    void read(const Chunk& chunk, std::span<unsigned char> head) {
        std::array<unsigned char, 1 << 15> buffer;
        for (std::uint32_t left = chunk.length; left > 0;) {
            const auto count = std::min<std::uint32_t>(left, buffer.size());
            take(buffer.data(), count, chunk);
            check_ = crc32(check_, buffer.data(), count);
            for (std::size_t i = 0; i < std::min<std::size_t>(head.size(), count); ++i) head[i] = buffer[i];
            head = {};
            left -= count;
        }
        std::array<unsigned char, 4> stored{};
        take(stored.data(), stored.size(), chunk);
        if (chunk.is_critical() && word_at(stored.data()) != check_)
            refuse(chunk, "is damaged: its checksum differs");
    }

    [[noreturn]] static void refuse(const Chunk& chunk, std::string_view what) {
        const std::string name = chunk.type.empty() ? "" : fmt::format(" {}", chunk.type);
        throw InputError(fmt::format("the PNG's chunk{} at byte {} {}", name, chunk.at, what));
    }

  private:
    static constexpr std::streamoff kSignature = 8;

    void take(unsigned char* to, std::size_t count, const Chunk& chunk) {
        in_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count));
        if (!in_) refuse(chunk, "is cut off");
    }

    std::ifstream in_;
    unsigned long check_ = 0;
};

// What the first chunk says.
struct Header {
    std::uint32_t width, height;
    int bits, colours, packing, filter, interlace;
};

bool is_known(const Header& header) {
    constexpr std::uint32_t kMostPixels = 1'000'000;  // on a side, by libpng's choice
    struct Kind {
        int colours;
        std::uint32_t bits;  // bit b: b bits are known
    };
    constexpr std::array<Kind, 5> kKinds{
        {{0, 0x10116}, {2, 0x10100}, {kPalette, 0x116}, {4, 0x10100}, {6, 0x10100}}};
    const auto is_side = [](std::uint32_t pixels) { return pixels > 0 && pixels <= kMostPixels; };
    return is_side(header.width) && is_side(header.height) && header.packing == 0 && header.filter == 0 &&
           header.interlace <= 1 && header.bits <= 16 &&
           std::any_of(kKinds.begin(), kKinds.end(), [&](const Kind& kind) {
               return kind.colours == header.colours && (kind.bits >> header.bits & 1) != 0;
           });
}

Header first_of(Chunks& chunks) {
    std::array<unsigned char, 13> bytes{};
    const Chunk chunk = chunks.next();
    if (chunk.type != "IHDR" || chunk.length != bytes.size())
        Chunks::refuse(chunk, "is not the header of a PNG");
    chunks.read(chunk, bytes);
    const Header header{word_at(&bytes[0]), word_at(&bytes[4]), bytes[8], bytes[9],
                        bytes[10],          bytes[11],          bytes[12]};
    if (!is_known(header)) {
        Chunks::refuse(
            chunk, fmt::format("has {} x {} pixels of {} bits and colour type {}, which PNG does not allow",
                               header.width, header.height, header.bits, header.colours));
    }
    return header;
}

// sRGB, gAMA, cHRM [PNG 11.3.3] and cICP; those of another length are none.
void read_colours(const Chunk& chunk, std::span<const unsigned char> content, PngColours& colours) {
    const auto share = [&](std::size_t i) { return word_at(&content[4 * i]) / 1e5; };
    if (chunk.type == "sRGB" && chunk.length == 1) colours.srgb = true;
    if (chunk.type == "gAMA" && chunk.length == 4) colours.gamma = share(0);
    if (chunk.type == "cICP" && chunk.length == 4)
        colours.coding_points = content[0] != 1 || content[1] != 13;
    if (chunk.type == "cHRM" && chunk.length == 32) {  // white comes first
        auto& c = colours.chromaticities.emplace();
        for (std::size_t i = 0; i < 8; ++i) c[(i + 6) % 8] = static_cast<float>(share(i));
    }
}

}  // namespace

PngColours check_png_chunks(const std::filesystem::path& file) {
    Chunks chunks(file);
    const Header header = first_of(chunks);
    bool palette = false, pixels = false;
    PngColours colours;
    for (Chunk chunk = chunks.next(); chunk.type != "IEND"; chunk = chunks.next()) {
        std::array<unsigned char, 32> content{};
        chunks.read(chunk, content);
        // A decoder passes over what stands behind the pixels, and behind the palette.
        if (!palette && !pixels) read_colours(chunk, content, colours);
        if (!chunk.is_critical()) continue;
        const bool is_palette = chunk.type == "PLTE", is_pixels = chunk.type == "IDAT";
        if (!is_palette && !is_pixels) Chunks::refuse(chunk, "is of an unknown critical type");
        // Of other kinds of colours it is but a hint.
        if (is_palette && header.colours == kPalette) {
            if (palette || pixels) Chunks::refuse(chunk, "is out of order");
            if (chunk.length == 0 || chunk.length > 768 || chunk.length % 3 != 0)
                Chunks::refuse(chunk,
                               fmt::format("has {} bytes, which is not a valid palette size", chunk.length));
        }
        if (is_pixels && header.colours == kPalette && !palette)
            Chunks::refuse(chunk, "is not preceded by a palette");
        palette = palette || is_palette;
        pixels = pixels || is_pixels;
    }
    if (!pixels) throw InputError("the PNG has no pixels");
    return colours;
}

}  // namespace lucerna
