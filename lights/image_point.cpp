// Point lights with an image: a lamp's distribution over all directions, or a slide in front of the point.
//
// A texel of the slide is a rectangle of the plane at distance 1. Its solid angle is the sum over its
// corners, with alternating signs, of atan(xy / sqrt(1 + x² + y²)). Within it, directions are uniform in the
// plane, where dω = cos³θ dA.
#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "lights/image_lights.h"
#include "lights/shaped_point.h"

namespace lucerna {
namespace {

// Returns the solid angle between the axis and the corner (x, y) of the plane at distance 1.
double corner_angle(double x, double y) {
    return atan2(x * y, std::sqrt(1 + x * x + y * y));
}

}  // namespace

Slide::Slide(std::shared_ptr<const Image> image, double fov_degrees, bool top_is_up)
    : image_(std::move(image)), up_(top_is_up ? 1 : -1) {
    assert(image_ && image_->width > 0 && image_->height > 0 && fov_degrees > 0 && fov_degrees < 180);
    const double half = tan(fov_degrees * kPiD / 360);
    const double aspect = static_cast<double>(image_->width) / image_->height;
    half_x_ = half * std::max(1.0, aspect);
    half_y_ = half * std::max(1.0, 1 / aspect);
    V3d sum(0, 0, 0);
    cdf_ = TexelCdf(image_->width, image_->height, [&](int x, int y) {
        const Rgb value = image_->rgb_at(x, y);
        const double angle = solid_angle(x, y);
        sum += V3d(value) * angle;
        return static_cast<double>(luminance(value)) * angle;
    });
    integral_ = Rgb(V3f(sum));
}

double Slide::solid_angle(int x, int y) const {
    const double x0 = edge_x(x), x1 = edge_x(x + 1), y0 = edge_y(y), y1 = edge_y(y + 1);
    return std::fabs(corner_angle(x1, y1) - corner_angle(x0, y1) - corner_angle(x1, y0) +
                     corner_angle(x0, y0));
}

Rgb Slide::at(const V3f& w) const {
    if (!(w.z > 0)) return Rgb(0.0F);
    const double x = (static_cast<double>(w.x / w.z) / half_x_ + 1) / 2;
    const double y = (1 - up_ * static_cast<double>(w.y / w.z) / half_y_) / 2;
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return Rgb(0.0F);
    return image_->rgb_at(static_cast<int>(x * image_->width), static_cast<int>(y * image_->height));
}

std::optional<Slide::Drawn> Slide::draw(const V2f& u) const {
    if (!(cdf_.total() > 0)) return std::nullopt;
    const TexelCdf::Draw texel = cdf_.draw(u);
    const V3d p(edge_x(texel.x + static_cast<double>(texel.within.x)),
                edge_y(texel.y + static_cast<double>(texel.within.y)), 1);
    const double area = 4 * half_x_ * half_y_ / image_->width / image_->height;
    const double r2 = p.length2();  // cos³ = r2^(-3/2)
    return Drawn{V3f(p / std::sqrt(r2)), image_->rgb_at(texel.x, texel.y),
                 static_cast<float>(texel.probability / area * r2 * std::sqrt(r2))};
}

std::unique_ptr<Light> make_goniometric_light(std::shared_ptr<const DirectionalImage> image,
                                              const V3f& position, const LightAxes& axes, const Rgb& scale,
                                              FluxUnit unit) {
    return std::make_unique<ShapedPointLight<DirectionalImage>>("goniometric", std::move(image), position,
                                                                axes, scale, unit);
}

std::unique_ptr<Light> make_projection_light(std::shared_ptr<const Slide> slide, const V3f& position,
                                             const LightAxes& axes, const Rgb& scale, FluxUnit unit) {
    return std::make_unique<ShapedPointLight<Slide>>("projection", std::move(slide), position, axes, scale,
                                                     unit);
}

}  // namespace lucerna
