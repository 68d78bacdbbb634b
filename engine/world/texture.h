// Colours that vary over a surface.
#pragma once

#include <filesystem>
#include <memory>

#include "engine/base/image.h"
#include "engine/base/vec.h"

namespace lucerna {

// A value: constant, checkerboard or an image; cheap to copy (images are shared and constant).
class RgbTexture {
  public:
    static RgbTexture constant(const Rgb& value);
    // Squares of (u scale, v scale) = 1.
    static RgbTexture checkerboard(const Rgb& even, const Rgb& odd, const V2f& scale);
    // Bilinear, repeating; v = 0 is the bottom row. The image is linear (read_texture_image decodes sRGB).
    static RgbTexture image(std::shared_ptr<const Image> image, const V2f& scale);

    Rgb at(const V2f& uv) const;

  private:
    enum class Kind : std::uint8_t { constant, checkerboard, image };
    Kind kind_ = Kind::constant;
    Rgb a_{0.0F}, b_{0.0F};
    V2f scale_{1, 1};
    std::shared_ptr<const Image> image_;
};

// Any format OpenImageIO reads; 8-bit files are decoded from sRGB. Throws InputError naming file and cause.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file);

}  // namespace lucerna
