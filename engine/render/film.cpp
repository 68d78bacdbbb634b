#include "engine/render/film.h"

#include <algorithm>
#include <functional>

namespace lucerna {
namespace {

constexpr std::size_t kSteps = 1024;

// The filter in steps fine enough that nobody sees them: a thousandth of its width.
Cdf tabulate(const std::function<double(double)>& filter, double radius) {
    std::vector<double> weights(kSteps);
    for (std::size_t i = 0; i < kSteps; ++i) {
        weights[i] = filter(radius * (2 * (static_cast<double>(i) + 0.5) / kSteps - 1));
    }
    return Cdf(weights);
}

float draw(const Cdf& cdf, float u, float radius) {
    const Cdf::Draw step = cdf.draw(u);
    return radius * (2 * (static_cast<float>(step.item) + step.remainder) / kSteps - 1);
}

}  // namespace

void Film::add(int x, int y, const Rgb& radiance) {
    Pixel& pixel =
        pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
    ++pixel.count;
    const V3f delta = radiance - pixel.mean;
    pixel.mean += delta / static_cast<float>(pixel.count);
    pixel.m2 += delta * (radiance - pixel.mean);
}

Image Film::develop(float scale) const {
    Image image(width_, height_, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        const Pixel& pixel = pixels_[i];
        const auto n = static_cast<float>(pixel.count);
        for (int c = 0; c < 3; ++c) {
            image.data[6 * i + static_cast<std::size_t>(c)] = pixel.mean[c] * scale;
            image.data[6 * i + 3 + static_cast<std::size_t>(c)] =
                pixel.count > 1 ? pixel.m2[c] / (n * (n - 1)) * scale * scale : 0.0F;
        }
    }
    return image;
}

FilterSampler::FilterSampler(const FilterSettings& settings) : settings_(settings) {
    const auto density = [&](double radius) -> std::function<double(double)> {
        if (settings.kind == FilterSettings::Kind::triangle) {
            return [radius](double x) { return radius - std::fabs(x); };
        }
        // pbrt's Gaussian: lowered so that it reaches 0 at the radius.
        const double two_variance = 2 * sqr(static_cast<double>(settings.sigma));
        const double edge = std::exp(-radius * radius / two_variance);
        return [two_variance, edge](double x) { return std::exp(-x * x / two_variance) - edge; };
    };
    if (settings.kind == FilterSettings::Kind::box) return;
    x_ = tabulate(density(settings.radius.x), settings.radius.x);
    y_ = tabulate(density(settings.radius.y), settings.radius.y);
}

V2f FilterSampler::offset(const V2f& u) const {
    if (x_.size() == 0) return {settings_.radius.x * (2 * u.x - 1), settings_.radius.y * (2 * u.y - 1)};
    return {draw(x_, u.x, settings_.radius.x), draw(y_, u.y, settings_.radius.y)};
}

}  // namespace lucerna
