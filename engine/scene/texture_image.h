// Textures made of images.
//
// Images that are small once decoded stay in memory, bytes as bytes. Larger ones, and all that come after a
// budget is spent, are read tile by tile through a cache of bounded size: memory does not grow with the
// scene's textures. Both give the same values, bit for bit: texels are decoded before they are interpolated.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "engine/base/image.h"
#include "engine/base/working_space.h"
#include "engine/scene/texture.h"

namespace lucerna {

class TileCache;

// How whole-number formats store light; half and float are linear already and are taken as they are.
struct Encoding {
    enum class Kind : std::uint8_t { srgb, linear, power };
    Kind kind = Kind::srgb;
    float exponent = 1;  // of `power`: value^exponent

    float decode(float stored) const;  // [0,1] to [0,1]
};

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
    // ratios of that space: files are in linear sRGB once decoded, OpenEXR's in the chromaticities that they
    // state, and what is outside the space's gamut is mixed with grey. Without it numbers are no colours and
    // stay as they are (normals). Throws InputError naming file and cause: not readable, not credible in
    // size, chromaticities that span no space, or a value that is negative or not finite.
    std::shared_ptr<const Texels> open(const std::filesystem::path& file, const Encoding& encoding,
                                       const std::optional<WorkingSpace>& colours = {});

    std::size_t bytes_in_memory() const { return in_memory_; }

  private:
    struct Opened {
        std::shared_ptr<const Texels> texels;
        std::optional<Chromaticities> stated;
    };
    Opened open_numbers(const std::filesystem::path& file, const Encoding& encoding);

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
// them. Whole-number formats (8 or 16 bits) are decoded from sRGB. Throws as TextureImages::open does.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file,
                                                const WorkingSpace& colours = {});

}  // namespace lucerna
