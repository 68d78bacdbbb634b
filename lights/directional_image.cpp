#include "lights/directional_image.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

int index_below(double place, int n) {
    return std::clamp(static_cast<int>(place), 0, n - 1);
}

// Within a row, directions are uniform in solid angle, hence linear in the cosine.
V3d direction_by_latitude(double x, double y, int width, int height) {
    const double row = std::min(std::floor(y), height - 1.0);
    const double low = cos(kPiD * row / height);
    const double high = cos(kPiD * (row + 1) / height);
    const double z = low + (y - row) * (high - low);
    const double r = std::sqrt(std::max(0.0, 1 - z * z));
    const double phi = 2 * kPiD * x / width;
    return {r * cos(phi), r * sin(phi), z};
}

}  // namespace

// In the first quadrant of a hemisphere, the corner (0,0) of the square is the pole, and u + v = r is a
// circle around it with 1 - cosθ = r², along which the azimuth is linear. Beyond r = 1 lies the other
// hemisphere, folded outwards.
V3d equal_area_direction(double x, double y) {
    const double u = 2 * x - 1, v = 2 * y - 1;
    const double up = std::fabs(u), vp = std::fabs(v);
    const double to_edge = 1 - (up + vp);  // > 0 in the upper hemisphere
    const double r = 1 - std::fabs(to_edge);
    const double phi = r > 0 ? ((vp - up) / r + 1) * kPiD / 4 : 0.0;
    const double sine = r * std::sqrt(2 - r * r);
    return {std::copysign(sine * cos(phi), u), std::copysign(sine * sin(phi), v),
            std::copysign(1 - r * r, to_edge)};
}

Imath::V2d equal_area_square(const V3d& w) {
    const double z = std::fabs(w.z);
    // Computes sqrt(1 - |z|) from the sine, which is accurate near the poles.
    const double r = std::sqrt((w.x * w.x + w.y * w.y) / (1 + z));
    const double phi = atan2(std::fabs(w.y), std::fabs(w.x)) * 2 / kPiD;  // [0,1]
    double v = std::min(1.0, r) * phi;
    double u = std::min(1.0, r) - v;
    if (w.z < 0) {
        const double folded = 1 - v;
        v = 1 - u;
        u = folded;
    }
    return {(std::copysign(u, w.x) + 1) / 2, (std::copysign(v, w.y) + 1) / 2};
}

std::shared_ptr<Image> image_by_latitude(int width, int height,
                                         const std::function<Rgb(const V3d& w)>& value) {
    auto image = std::make_shared<Image>(Image::rgb(width, height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x)
            image->set_rgb(x, y, value(direction_by_latitude(x + 0.5, y + 0.5, width, height)));
    }
    return image;
}

DirectionalImage::DirectionalImage(std::shared_ptr<const Image> image, SphereMap map)
    : image_(std::move(image)), map_(map) {
    assert(image_ && image_->width > 0 && image_->height > 0);
    V3d sum(0, 0, 0);
    cdf_ = TexelCdf(image_->width, image_->height, [&](int x, int y) {
        const Rgb value = image_->rgb_at(x, y);
        sum += V3d(value) * solid_angle(y);
        return static_cast<double>(luminance(value)) * solid_angle(y);
    });
    integral_ = Rgb(V3f(sum));
}

double DirectionalImage::solid_angle(int y) const {
    if (map_ == SphereMap::equal_area) return 4 * kPiD / image_->width / image_->height;
    // Computes Δφ (cosθ0 - cosθ1) as a product that does not cancel.
    const double half = kPiD / (2.0 * image_->height);
    return 2 * kPiD / image_->width * 2 * sin((2 * y + 1) * half) * sin(half);
}

V3d DirectionalImage::direction(double x, double y) const {
    if (map_ == SphereMap::equal_area) {
        return equal_area_direction(x / image_->width, y / image_->height);
    }
    return direction_by_latitude(x, y, image_->width, image_->height);
}

DirectionalImage::Texel DirectionalImage::texel_of(const V3f& w) const {
    const V3d d(w);
    if (map_ == SphereMap::equal_area) {
        const Imath::V2d at = equal_area_square(d);
        return {index_below(at.x * image_->width, image_->width),
                index_below(at.y * image_->height, image_->height)};
    }
    const double phi = atan2(d.y, d.x);
    const double theta = atan2(hypot(d.x, d.y), d.z);
    return {index_below((phi < 0 ? phi + 2 * kPiD : phi) / (2 * kPiD) * image_->width, image_->width),
            index_below(theta / kPiD * image_->height, image_->height)};
}

Rgb DirectionalImage::at(const V3f& w) const {
    const Texel texel = texel_of(w);
    return image_->rgb_at(texel.x, texel.y);
}

std::optional<DirectionalImage::Drawn> DirectionalImage::draw(const V2f& u) const {
    if (!(cdf_.total() > 0)) return std::nullopt;
    const TexelCdf::Draw texel = cdf_.draw(u);
    const V3d w = direction(texel.x + static_cast<double>(texel.within.x),
                            texel.y + static_cast<double>(texel.within.y));
    return Drawn{V3f(w).normalized(), image_->rgb_at(texel.x, texel.y),
                 static_cast<float>(texel.probability / solid_angle(texel.y))};
}

float DirectionalImage::pdf_w(const V3f& w) const {
    const Texel texel = texel_of(w);
    return static_cast<float>(cdf_.probability(texel.x, texel.y) / solid_angle(texel.y));
}

Rgb DirectionalImage::irradiance() const {
    V3d sum(0);
    for (int y = 0; y < image_->height; ++y) {
        for (int x = 0; x < image_->width; ++x) {
            const double cosine = std::max(0.0, direction(x + 0.5, y + 0.5).z);
            sum += V3d(image_->rgb_at(x, y)) * (cosine * solid_angle(y));
        }
    }
    return Rgb(V3f(sum));
}

}  // namespace lucerna
