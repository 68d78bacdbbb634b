// Textures made of images.
//
// Images that are small once decoded stay in memory, bytes as bytes. Larger ones, and all that come after a
// budget is spent, are read tile by tile through a cache of bounded size: memory does not grow with the
// scene's textures, except with those that are Radiance pictures, which stay in memory. Both give the same
// values, bit for bit: texels are decoded before they are interpolated.
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

// Is told what of a file's colours is not followed, in a sentence that names the file.
using PictureWarning = std::function<void(const std::string&)>;

// Two neighbours in each direction; equal ones at an edge.
struct TexelSquare {
    int x[2], y[2];
};

// An image as a texture sees it: decoded texels, wherever they lie. Constant, shared, safe from any thread.
class Texels {
  public:
    virtual ~Texels() = default;
    virtual int width() const = 0;
    virtual int height() const = 0;
    // Of all channels of all texels; finite and not negative.
    virtual ValueRange range() const = 0;
    // (x0,y0), (x1,y0), (x0,y1), (x1,y1), rows running down. Throws InputError if the file has become
    // unreadable since it was opened.
    virtual std::array<Rgb, 4> square(const TexelSquare& at) const = 0;
    // Begins to fetch them from memory, if that is where they lie.
    virtual void prefetch(const TexelSquare& /*at*/) const {}
};

std::shared_ptr<const Texels> texels_of(std::shared_ptr<const Image> image);  // linear

struct TextureMemory {
    std::size_t one = std::size_t{64} << 20;   // bytes that an image may take to be kept
    std::size_t all = std::size_t{1} << 30;    // bytes that all kept images may take
    std::size_t cache = std::size_t{1} << 30;  // bytes of tiles of the others
};

// Opens images for textures, each once. What it returned lives on without it.
class TextureImages {
  public:
    explicit TextureImages(const TextureMemory& memory = {});
    ~TextureImages();
    TextureImages(const TextureImages&) = delete;
    TextureImages& operator=(const TextureImages&) = delete;

    // Any format that pictures.h reads. Grey files are grey, alpha is left out. With `colours` texels are
    // ratios of that space: files are in the space that they state (picture_colours.h) once decoded, linear
    // sRGB where they state none, and what is outside the working space's gamut is mixed with grey. Without
    // it numbers are no colours and stay as they are (normals). An encoding other than the file's own stands
    // for all that the file says of whole numbers. Throws InputError naming file and cause: not readable, not
    // credible in size, integers of other sizes than 8 and 16 bits, chromaticities that span no space, or a
    // value that is negative or not finite.
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
    std::unique_ptr<const TileCache> cache_;  // made when first needed
    std::map<std::string, Opened> opened_;    // by file and encoding
};

// What lies beyond the image: it again, its edge, or nothing.
enum class Wrap : std::uint8_t { repeat, clamp, black };

struct ImageLookup {
    Mapping2 mapping = UvMapping{};
    Wrap wrap = Wrap::repeat;
    float scale = 1;      // >= 0
    bool invert = false;  // 1 - value, after the scale; 0 where that is negative
};
// Bilinear between texel centres; (s,t) = (0,0) is the lower left corner of the image. Numbers are
// luminances.
template <typename Value>
Texture<Value> image_texture(std::shared_ptr<const Texels> texels, const ImageLookup& lookup);

// The same formats as a whole image R, G, B, for lights: ratios of `colours`, as TextureImages::open makes
// them with the file's own encoding. Throws as TextureImages::open does.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file,
                                                const WorkingSpace& colours = {},
                                                const PictureWarning& warn = {});

}  // namespace lucerna
