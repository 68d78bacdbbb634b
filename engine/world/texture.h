// Colours that vary over a surface.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>

#include "engine/base/image.h"
#include "engine/base/vec.h"

namespace lucerna {

// A value: constant, checkerboard or an image; cheap to copy (images are shared and constant).
class RgbTexture {
  public:
    static RgbTexture constant(const Rgb& value);
    // Squares of side 1 in (u scale.x, v scale.y); the one that starts at (0,0) is even.
    static RgbTexture checkerboard(const Rgb& even, const Rgb& odd, const V2f& scale);
    // Bilinear between texel centres, repeating; (0,0) is the lower left corner of the image. The image is
    // linear (read_texture_image decodes sRGB) and not empty.
    static RgbTexture image(std::shared_ptr<const Image> image, const V2f& scale);

    // Never reads outside the image: a coordinate that is not finite counts as 0.
    Rgb at(const V2f& uv) const;

  private:
    enum class Kind : std::uint8_t { constant, checkerboard, image };
    Kind kind_ = Kind::constant;
    Rgb a_{0.0F}, b_{0.0F};
    V2f scale_{1, 1};
    std::shared_ptr<const Image> image_;
};

// Any format OpenImageIO reads, as an image R, G, B; grey files are grey, alpha is left out. Whole-number
// formats (8 or 16 bits) are decoded from sRGB, half and float are linear already. Throws InputError naming
// file and cause: not readable, not credible in size, or a value that is negative or not finite.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file);

}  // namespace lucerna
