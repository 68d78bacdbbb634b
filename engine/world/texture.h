// Colours that vary over a surface.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "engine/base/image.h"
#include "engine/base/vec.h"

namespace lucerna {

// Where a texture is asked.
struct TexturePoint {
    TexturePoint(const V2f& at_uv, const V3d& at_p = V3d(0)) : uv(at_uv), p(at_p) {}

    V2f uv;  // the surface's
    V3d p;   // world position, for textures that fill space
};

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
    Rgb at(const TexturePoint& point) const;

  private:
    enum class Kind : std::uint8_t { constant, checkerboard, image };
    Kind kind_ = Kind::constant;
    Rgb a_{0.0F}, b_{0.0F};
    V2f scale_{1, 1};
    std::shared_ptr<const Image> image_;
};

// A number that varies over a surface: roughness, alpha, displacement.
class FloatTexture {
  public:
    static FloatTexture constant(float value) {
        FloatTexture texture;
        texture.value_ = value;
        return texture;
    }
    float at(const TexturePoint& /*point*/) const { return value_; }
    // The value if it is the same everywhere.
    std::optional<float> constant_value() const { return value_; }

  private:
    float value_ = 0;
};

// Any format OpenImageIO reads, as an image R, G, B; grey files are grey, alpha is left out. Whole-number
// formats (8 or 16 bits) are decoded from sRGB, half and float are linear already. Throws InputError naming
// file and cause: not readable, not credible in size, or a value that is negative or not finite.
std::shared_ptr<const Image> read_texture_image(const std::filesystem::path& file);

}  // namespace lucerna
