// Reads and writes picture files of every usual format by a library that is loaded on first use.
//
// OpenImageIO knows the formats, but it loads some 260 shared libraries, which takes a quarter of a second
// before main(). Commands that use no picture, or only write a PNG (write_png()), should not wait for that.
// The code that calls it is therefore in the shared library liblucerna_pictures.so (engine/pictures/). This
// header is the interface to it: plain types, and pictures(), which loads it. The callers of this interface
// decide what the numbers mean and which are refused.
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

// A picture for people has colours; a measurement has the camera's numbers, whatever the file states about
// colours.
enum class PictureUse : std::uint8_t { colour, measurement };

// Names the kind of a file's numbers: unsigned integers of 8 bits, of 16 bits, other integers; half or float,
// other floats.
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

// Holds the header of a file. It may lie, so check it before allocating.
struct PictureHeader {
    int width = 0, height = 0;
    bool flat = true;  // one layer, and one sample for each pixel
    PictureNumbers numbers = PictureNumbers::bytes;
    std::string kind;  // name of the numbers' type, for example "uint8" or "half"
    int bits = 0;      // of an integer in the file, which may be fewer than those of `numbers`
    int channels = 0;  // may be 0 in a damaged file
    std::vector<std::string> channel_names;
    std::vector<bool> integer_channels;  // for each channel, whether it holds integers
    // x and y of red, green, blue and white, as stated by an OpenEXR file or a Radiance picture.
    std::optional<std::array<float, 8>> chromaticities = {};
    std::vector<std::uint8_t> icc_profile = {};
    PngColours png = {};
};

// No format packs pixels better than this: runs of one value, packed twice.
inline constexpr std::uint64_t kBestCompression = 1 << 16;
// Returns whether the file may hold so many pixels. Otherwise nothing is allocated on the header's word.
bool is_credible(const std::filesystem::path& file, const PictureHeader& header);

struct ChannelRange {
    int first, end;
};

// Reads an open file. It must not be used by several threads at a time.
class PictureReader {
  public:
    virtual ~PictureReader() = default;
    virtual const PictureHeader& header() const = 0;
    // Reads all pixels, row by row from the top, the channels of the range interleaved. `out` has exactly
    // this size. Numbers are converted; integers become floats by division by the largest integer. Colours
    // are not multiplied by alpha. Throws std::runtime_error with the library's message.
    virtual void read(const ChannelRange& channels, std::span<std::uint8_t> out) = 0;
    virtual void read(const ChannelRange& channels, std::span<std::uint16_t> out) = 0;
    virtual void read(const ChannelRange& channels, std::span<float> out) = 0;
};

// Pixels [x0, x1) × [y0, y1), counted from the top left corner.
struct PictureRegion {
    int x0, x1, y0, y1;
};

// Reads a file through a cache of tiles. It is thread-safe and keeps the cache alive.
class TiledPicture {
  public:
    virtual ~TiledPicture() = default;
    // Reads the channels with which it was opened, as PictureReader does. This may be the first call that
    // finds the file unreadable.
    virtual void read(const PictureRegion& box, std::span<std::uint8_t> out) const = 0;
    virtual void read(const PictureRegion& box, std::span<float> out) const = 0;
};

class TileCache {
  public:
    virtual ~TileCache() = default;
    // Opens these channels of the file. Throws std::runtime_error with the library's message.
    virtual std::unique_ptr<const TiledPicture> open(const std::filesystem::path& file,
                                                     const ChannelRange& channels) const = 0;
};

enum class PictureFormat : std::uint8_t { png, tiff, exr };

// Describes a measurement to be written: row by row from the top, channels interleaved.
struct PictureToWrite {
    PictureFormat format;
    int width, height, channels;
    std::variant<std::span<const std::uint8_t>, std::span<const std::uint16_t>, std::span<const float>>
        values;
};

// Holds a drawing in SVG as pixels on white: row by row from the top, red, green and blue of 8 bits.
struct DrawnSvg {
    int width = 0, height = 0;
    std::vector<std::uint8_t> rgb;
};

// Gives the functions of the loaded library. It is stateless and thread-safe, and lives until the process
// ends.
class Pictures {
  public:
    virtual ~Pictures() = default;
    // Throws std::runtime_error with the library's message.
    virtual std::unique_ptr<PictureReader> open(const std::filesystem::path& file, PictureUse use) const = 0;
    // Makes a cache of at most `bytes`, with tiles of 64 × 64 pixels even for files that are not tiled.
    virtual std::unique_ptr<TileCache> tiles(std::size_t bytes) const = 0;
    // Writes in place, in the picture's format, whatever the file's suffix. Throws std::runtime_error.
    virtual void write(const std::filesystem::path& file, const PictureToWrite& picture) const = 0;
    // Draws at `scale` times the drawing's own size. `font` is the font family of its text. Throws
    // std::runtime_error if that is not installed, or with the library's message.
    virtual DrawnSvg draw_svg(std::string_view svg, double scale, const std::string& font) const = 0;
};

// Loads the library if it is not loaded yet; thread-safe. Throws InputError if none of the folders has it, or
// if the first one found cannot be used; the error names `file`, for which the library is needed.
const Pictures& pictures(const std::filesystem::path& file,
                         const std::vector<std::filesystem::path>& folders = library_folders());

// Opens a picture of any format; no other function opens pictures to read pixels. The header is checked
// first, because some decoders allocate all that it claims. Throws InputError naming the file if it is not
// readable or claims more than the file can hold. The pixels may still be damaged.
struct OpenedPicture {
    std::unique_ptr<PictureReader> reader;
    PictureHeader header;  // the reader's, with a PNG's colours
    bool tiled;            // whether a TileCache opens it
};
OpenedPicture open_picture(const std::filesystem::path& file, PictureUse use);

// Opens a Radiance picture (.hdr). Throws InputError (without the file's name) for an invalid header.
std::unique_ptr<PictureReader> open_radiance(const std::filesystem::path& file);

// Describes the parts of an OpenEXR file.
struct ExrParts {
    int count = 0;
    bool scan_lines = true;  // in all of them; otherwise some have tiles or deep data
};
// Checks the headers of an OpenEXR file before its pixels are read. Throws InputError (without the file's
// name) for a file of another format, a damaged header, and images larger than the file or memory can hold.
// The pixels may still be damaged.
ExrParts check_exr_header(const std::filesystem::path& file);

// Checks a PNG's chunks before libpng reads them, because libpng also prints what is wrong with them on
// standard error. Returns the colours that the chunks state. Throws InputError (without the file's name) for
// a header that PNG does not allow [PNG 11.2.2], and for a necessary chunk that is missing, cut off, damaged
// or unknown. The compressed data may still be damaged.
PngColours check_png_chunks(const std::filesystem::path& file);

}  // namespace lucerna

// This is the only function that liblucerna_pictures.so exports. The number changes with the types above, so
// that a library of another version is refused.
extern "C" const lucerna::Pictures* lucerna_pictures_4();
