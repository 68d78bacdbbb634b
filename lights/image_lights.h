// Lights whose colour is an image: a sky, a lamp's distribution, a projected slide. Positions are relative to
// the scene's origin and lengths in scene units. Comments that state W mean lm for a light that counts in
// lumens.
#pragma once

#include <memory>

#include "engine/base/vec.h"
#include "lights/directional_image.h"
#include "lights/light.h"

namespace lucerna {

// An image's axes in the world: orthonormal, of either handedness (skies are often mirrored).
struct LightAxes {
    V3f x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

    V3f to_world(const V3f& v) const { return v.x * x + v.y * y + v.z * z; }
    V3f to_local(const V3f& v) const { return {v.dot(x), v.dot(y), v.dot(z)}; }
};

// Makes a sky whose radiance is `scale` times the image [W/(m² sr)].
std::unique_ptr<Light> make_image_infinite_light(std::shared_ptr<const DirectionalImage> image,
                                                 const LightAxes& axes, const Rgb& scale,
                                                 const SceneSphere& scene, FluxUnit unit = FluxUnit::watt);

// Makes a point light whose intensity is `scale` times the image [W/sr].
std::unique_ptr<Light> make_goniometric_light(std::shared_ptr<const DirectionalImage> image,
                                              const V3f& position, const LightAxes& axes, const Rgb& scale,
                                              FluxUnit unit = FluxUnit::watt);

// A slide in front of a point light, perpendicular to z. Its shorter side spans the field of view; columns
// run along x.
class Slide {
  public:
    // The image is as for DirectionalImage. Requires 0 < fov_degrees < 180. With `top_is_up` the top row lies
    // at +y (pbrt-v4), otherwise at -y (pbrt versions 1 to 3).
    Slide(std::shared_ptr<const Image> image, double fov_degrees, bool top_is_up);

    Rgb at(const V3f& w) const;  // 0 outside the slide
    struct Drawn {
        V3f w;
        Rgb value;
        float pdf_w;  // > 0
    };
    // Draws by luminance and solid angle. Returns none if the slide is black.
    std::optional<Drawn> draw(const V2f& u) const;
    Rgb integral() const { return integral_; }  // ∫ value dω

  private:
    double edge_x(double x) const { return half_x_ * (2 * x / image_->width - 1); }
    double edge_y(double y) const { return up_ * half_y_ * (1 - 2 * y / image_->height); }
    double solid_angle(int x, int y) const;

    std::shared_ptr<const Image> image_;
    double half_x_, half_y_;  // half the slide's size at distance 1
    double up_;               // 1: the top row lies at +y; -1: at -y
    TexelCdf cdf_;
    Rgb integral_{0.0F};
};
std::unique_ptr<Light> make_projection_light(std::shared_ptr<const Slide> slide, const V3f& position,
                                             const LightAxes& axes, const Rgb& scale,
                                             FluxUnit unit = FluxUnit::watt);

}  // namespace lucerna
