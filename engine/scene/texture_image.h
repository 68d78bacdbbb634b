// Makes textures of images.
//
// Images that are small once decoded stay in memory, bytes as bytes. Larger ones, and all that come after a
// memory budget is used up, are read tile by tile through a cache of bounded size, so that memory does not
// grow with the scene's textures. Radiance pictures are the exception and always stay in memory. Both ways
// give the same values, bit for bit, because texels are decoded before they are interpolated.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "engine/colour/working_space.h"
#include "engine/image/image.h"
#include "engine/image/picture_colours.h"
#include "engine/scene/texture.h"

namespace lucerna {

class TileCache;

// Receives a sentence that names the file and says which of its colour information is ignored.
using PictureWarning = std::function<void(const std::string&)>;

// Holds two neighbouring texels in each direction, which are equal at an edge.
struct TexelSquare {
    int x[2], y[2];
};

// Provides an image as decoded texels, independent of storage. It is constant and thread-safe.
class Texels {
  public:
    virtual ~Texels() = default;
    virtual int width() const = 0;
    virtual int height() const = 0;
    // Returns bounds of all channels of all texels, finite and not negative.
    virtual ValueRange range() const = 0;
    // Returns the texels (x0,y0), (x1,y0), (x0,y1), (x1,y1); y points down. Throws InputError if the file has
    // become unreadable since it was opened.
    virtual std::array<Rgb, 4> square(const TexelSquare& at) const = 0;
    // Prefetches the texels if they are in memory.
    virtual void prefetch(const TexelSquare& /*at*/) const {}
};

std::shared_ptr<const Texels> texels_of(std::shared_ptr<const Image> image);  // linear

struct TextureMemory {
    std::size_t one = std::size_t{64} << 20;   // largest image that is kept in memory, bytes
    std::size_t all = std::size_t{1} << 30;    // limit of all images in memory, bytes
    std::size_t cache = std::size_t{1} << 30;  // size of the tile cache for the other images, bytes
};

// Opens images for textures, each once. The returned texels may outlive it.
class TextureImages {
  public:
    explicit TextureImages(const TextureMemory& memory = {});
    ~TextureImages();
    TextureImages(const TextureImages&) = delete;
    TextureImages& operator=(const TextureImages&) = delete;

    // Opens a file in any format that pictures.h reads. Grey files are grey; alpha is ignored. With `colours`
    // texels are ratios of that space: decoded values are in the space that the file states
    // (picture_colours.h), linear sRGB by default, and colours outside the working space's gamut are mixed
    // with grey. Without it the values are not colours (e.g. normals) and stay as they are. An encoding other
    // than the file's own replaces everything that the file states about integers. Throws InputError that
    // names file and cause: unreadable, implausible size, integers other than 8 and 16 bits, chromaticities
    // that span no space, or a value that is negative or not finite.
    std::shared_ptr<const Texels> open(const std::filesystem::path& file, const Encoding& encoding,
                                       const std::optional<WorkingSpace>& colours = {},
                                       const PictureWarning& warn = {});

    std::size_t bytes_in_memory() const { return in_memory_; }

  private:
    struct Opened {
        std::shared_ptr<const Texels> texels;
        std::optional<ColourSpace> space;
    };
    Opened open_numbers(const std::filesystem::path& file, const Encoding& encoding,
                        const PictureWarning& warn);

    TextureMemory memory_;
    std::size_t in_memory_ = 0;
    std::unique_ptr<const TileCache> cache_;  // created on first use
    std::map<std::string, Opened> opened_;    // key: file and encoding
};

// Determines the values beyond the image: repeated, those of its edge, or 0.
enum class Wrap : std::uint8_t { repeat, clamp, black };

struct ImageLookup {
    Mapping2 mapping = UvMapping{};
    Wrap wrap = Wrap::repeat;
    float scale = 1;      // >= 0
    bool invert = false;  // 1 - value, after the scale; 0 where that is negative
};
// Interpolates bilinearly between texel centres; (s,t) = (0,0) is the lower left corner of the image. A
// number texture has the luminance.
template <typename Value>
Texture<Value> image_texture(std::shared_ptr<const Texels> texels, const ImageLookup& lookup);

// Reads the same formats as a whole RGB image, for lights: ratios of `colours`, converted as by
// TextureImages::open with the file's own encoding. Throws as TextureImages::open does.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file,
                                                const WorkingSpace& colours = {},
                                                const PictureWarning& warn = {});

}  // namespace lucerna
