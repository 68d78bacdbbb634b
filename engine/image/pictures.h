// Picture files of every usual format, by a library that is loaded when the first of them is touched.
//
// OpenImageIO knows the formats and brings some 260 shared libraries along: a quarter of a second before
// main(). Whoever reads and writes no picture need not wait for that. So the code that uses it is a shared
// library of its own, liblucerna_pictures.so (engine/pictures/), and this is the door to it: plain types, and
// `pictures`, which loads it. What the numbers mean, and which are refused, is decided on this side of the
// door.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/system/module.h"

namespace lucerna {

// A picture for people carries colours; a measurement is the camera's own numbers, whatever the file says
// about colours.
enum class PictureUse : std::uint8_t { colour, measurement };

// The kind of a file's numbers: whole ones of 8 and of 16 bits without a sign, others; half and float,
// others.
enum class PictureNumbers : std::uint8_t { bytes, words, other_whole, floats, other_floats };

constexpr bool are_whole(PictureNumbers numbers) {
    return numbers <= PictureNumbers::other_whole;
}

// Holds what the chunks of a PNG state about its colours.
struct PngColours {
    bool srgb = false;                                        // sRGB
    bool coding_points = false;                               // cICP, of other colours than sRGB
    std::optional<double> gamma = {};                         // gAMA: the numbers are light to this power
    std::optional<std::array<float, 8>> chromaticities = {};  // cHRM: x and y of red, green, blue and white
};

// What a file says of itself. It may lie: check before allocating.
struct PictureHeader {
    int width = 0, height = 0;
    bool flat = true;  // one layer, and one sample for each pixel
    PictureNumbers numbers = PictureNumbers::bytes;
    std::string kind;  // of the numbers, as "uint8" or "half"
    int bits = 0;      // of a whole number in the file; it may hold fewer than `numbers` has room for
    int channels = 0;  // may be 0 in a bad file
    std::vector<std::string> channel_names;
    std::vector<bool> integer_channels;  // those of whole numbers, in a file of several kinds
    // x and y of red, green, blue and white that an OpenEXR file or a Radiance picture states.
    std::optional<std::array<float, 8>> chromaticities = {};
    std::vector<std::uint8_t> icc_profile = {};
    PngColours png = {};
};

// No format packs pixels better than this: runs of one value, packed twice.
inline constexpr std::uint64_t kBestCompression = 1 << 16;
// Whether the file may hold so many pixels. Otherwise nothing is allocated on the header's word.
bool is_credible(const std::filesystem::path& file, const PictureHeader& header);

struct ChannelRange {
    int first, end;
};

// One file, open. For one thread at a time.
class PictureReader {
  public:
    virtual ~PictureReader() = default;
    virtual const PictureHeader& header() const = 0;
    // All pixels: rows from the top, the channels of the range interleaved; `out` has room for exactly these.
    // Numbers are converted: whole ones become floats by division by the largest. Colours are not multiplied
    // by alpha. Throws std::runtime_error with the library's words.
    virtual void read(const ChannelRange& channels, std::span<std::uint8_t> out) = 0;
    virtual void read(const ChannelRange& channels, std::span<std::uint16_t> out) = 0;
    virtual void read(const ChannelRange& channels, std::span<float> out) = 0;
};

// Pixels [x0, x1) × [y0, y1), from the top left corner.
struct PictureRegion {
    int x0, x1, y0, y1;
};

// A file whose pixels come through a cache of tiles. Safe from any thread; keeps the cache alive.
class TiledPicture {
  public:
    virtual ~TiledPicture() = default;
    // As PictureReader reads, of the channels it was opened with; that the file cannot be read may be found
    // out no sooner than here.
    virtual void read(const PictureRegion& box, std::span<std::uint8_t> out) const = 0;
    virtual void read(const PictureRegion& box, std::span<float> out) const = 0;
};

class TileCache {
  public:
    virtual ~TileCache() = default;
    // Those channels of the file. Throws std::runtime_error with the library's words.
    virtual std::unique_ptr<const TiledPicture> open(const std::filesystem::path& file,
                                                     const ChannelRange& channels) const = 0;
};

enum class PictureFormat : std::uint8_t { png, tiff, exr };

// What is to be written: rows from the top, channels interleaved.
struct PictureToWrite {
    PictureFormat format;
    PictureUse use;
    int width, height, channels;
    std::variant<std::span<const std::uint8_t>, std::span<const std::uint16_t>, std::span<const float>>
        values;
};

// A drawing in SVG as pixels: rows from the top, red, green and blue of 8 bits, on white.
struct DrawnSvg {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

// What the loaded library can do. Without state, safe from any thread; lives until the process ends.
class Pictures {
  public:
    virtual ~Pictures() = default;
    // Throws std::runtime_error with the library's words.
    virtual std::unique_ptr<PictureReader> open(const std::filesystem::path& file, PictureUse use) const = 0;
    // Tiles of 64 × 64 pixels, also of files that are not tiled, in at most so many bytes of memory.
    virtual std::unique_ptr<TileCache> tiles(std::size_t bytes) const = 0;
    // The bytes of a file. Throws std::runtime_error.
    virtual std::vector<unsigned char> encode(const PictureToWrite& picture) const = 0;
    // In place; the format is the one asked for, whatever the file's name. Throws std::runtime_error.
    virtual void write(const std::filesystem::path& file, const PictureToWrite& picture) const = 0;
    // At `scale` times its own size. `font` is the family that its text is in. Throws std::runtime_error
    // where that is not installed, and with the library's words.
    virtual DrawnSvg draw_svg(std::string_view svg, double scale, const std::string& font) const = 0;
};

// The library, loaded if it is not yet; safe from any thread. Throws InputError, which names `file`, on whose
// behalf it is wanted: there is none in any of the folders, or the first there is cannot be used.
const Pictures& pictures(const std::filesystem::path& file,
                         const std::vector<std::filesystem::path>& folders = library_folders());

// A picture of any format: the one way in which files are opened to read pixels. Before a library opens one,
// its header is checked, because decoders of some formats make room for all that a header tells of. Throws
// InputError naming the file: not readable, or more than the file can hold. What passes may still be damaged.
struct OpenedPicture {
    std::unique_ptr<PictureReader> reader;
    PictureHeader header;  // with what is known of the file besides the reader
    bool tiled;            // whether a TileCache opens it
};
OpenedPicture open_picture(const std::filesystem::path& file, PictureUse use);

// A Radiance picture (.hdr). Throws InputError (without the file's name) for a header that is none.
std::unique_ptr<PictureReader> open_radiance(const std::filesystem::path& file);

// What the header of an OpenEXR file says of its parts.
struct ExrParts {
    int count = 0;
    bool scan_lines = true;  // in all of them; otherwise some have tiles or deep data
};
// Checks the headers of an OpenEXR file before its pixels are read. Throws InputError (without the file's
// name) for a file of another format, a damaged header, and images larger than the file or memory can hold.
// The pixels may still be damaged.
ExrParts check_exr_header(const std::filesystem::path& file);

// A look at a PNG's chunks before a library reads them: libpng would say what is wrong with them on standard
// error, too, beside the error that names the file.

// Returns the colours that the chunks state. Throws InputError (without the file's name) for a header that
// PNG does not know [PNG 11.2.2], a chunk that the picture needs and that is cut off, damaged or unknown, and
// where one is missing. What passes may still be damaged inside its compressed data.
PngColours check_png_chunks(const std::filesystem::path& file);

}  // namespace lucerna

// The one thing that liblucerna_pictures.so gives away. The number changes with the types above, so that a
// library of another age is refused.
extern "C" const lucerna::Pictures* lucerna_pictures_3();
