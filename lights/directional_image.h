// Light that depends on direction alone, given as an image: a sky, or a lamp's distribution.
//
// The value is constant over the piece of the sphere that a texel covers (as in pbrt-v4), so that values,
// densities and integrals agree exactly.
//
// Sources: the equal-area map of the square to the sphere follows [Clarberg 2008] with pbrt-v4's orientation;
// latitude-longitude images are oriented as in pbrt-v3.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "lights/texel_cdf.h"

namespace lucerna {

enum class SphereMap : std::uint8_t {
    // The top row is at +z, the bottom row at -z; columns run from +x over +y, -x and -y back to +x.
    latitude_longitude,
    // +z is in the middle, -z at the corners, +x to the right, +y down. All texels have the same solid angle.
    equal_area
};

// Map between the unit square (x to the right, y down) and unit directions; equal areas map to equal solid
// angles.
V3d equal_area_direction(double x, double y);
Imath::V2d equal_area_square(const V3d& w);

// Returns a latitude-longitude image of `value` at the middles of the texels.
std::shared_ptr<Image> image_by_latitude(int width, int height,
                                         const std::function<Rgb(const V3d& w)>& value);

class DirectionalImage {
  public:
    // The image has channels R, G and B, finite and not negative, and at least one pixel.
    DirectionalImage(std::shared_ptr<const Image> image, SphereMap map);

    // Directions are unit and in the image's own frame.
    Rgb at(const V3f& w) const;

    struct Drawn {
        V3f w;
        Rgb value;    // at w
        float pdf_w;  // > 0
    };
    // Draws by luminance and solid angle. Returns none if the image is black.
    std::optional<Drawn> draw(const V2f& u) const;
    // Returns the density per solid angle with which draw() gives w.
    float pdf_w(const V3f& w) const;

    // Returns ∫ value dω over the sphere.
    Rgb integral() const { return integral_; }
    // Returns the irradiance of a plane that faces +z, by texel centres.
    Rgb irradiance() const;

  private:
    struct Texel {
        int x, y;
    };
    Texel texel_of(const V3f& w) const;
    V3d direction(double x, double y) const;  // x in [0,width], y in [0,height]
    double solid_angle(int y) const;          // of a texel in row y

    std::shared_ptr<const Image> image_;
    SphereMap map_;
    TexelCdf cdf_;
    Rgb integral_{0.0F};
};

}  // namespace lucerna
