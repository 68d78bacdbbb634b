#include "engine/render/film.h"

#include <algorithm>
#include <functional>

namespace lucerna {
namespace {

constexpr std::size_t kSteps = 1024;

// Inverse CDF of a filter over [-radius, radius], at kSteps + 1 equal steps of probability.
std::vector<float> invert(const std::function<double(double)>& filter, double radius) {
    // Fine midpoint sums of the density, then the places where they pass each step.
    constexpr std::size_t kFine = 16 * kSteps;
    std::vector<double> upto(kFine + 1, 0.0);
    for (std::size_t i = 0; i < kFine; ++i) {
        const double x = radius * (2 * (static_cast<double>(i) + 0.5) / kFine - 1);
        upto[i + 1] = upto[i] + filter(x);
    }
    std::vector<float> inverse(kSteps + 1);
    std::size_t i = 0;
    for (std::size_t step = 0; step <= kSteps; ++step) {
        const double target = upto.back() * static_cast<double>(step) / kSteps;
        while (i + 1 < kFine && upto[i + 1] < target) ++i;
        const double weight = upto[i + 1] - upto[i];
        const double part = weight > 0 ? std::clamp((target - upto[i]) / weight, 0.0, 1.0) : 0.0;
        inverse[step] = static_cast<float>(radius * (2 * (static_cast<double>(i) + part) / kFine - 1));
    }
    return inverse;
}

float look_up(const std::vector<float>& inverse, float u) {
    const float place = u * static_cast<float>(kSteps);
    const auto step = std::min(static_cast<std::size_t>(place), kSteps - 1);
    const float part = place - static_cast<float>(step);
    return inverse[step] + part * (inverse[step + 1] - inverse[step]);
}

}  // namespace

void Film::add(int x, int y, const Rgb& radiance) {
    Pixel& pixel = pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
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
    inverse_x_ = invert(density(settings.radius.x), settings.radius.x);
    inverse_y_ = invert(density(settings.radius.y), settings.radius.y);
}

V2f FilterSampler::offset(const V2f& u) const {
    if (inverse_x_.empty()) {
        return {settings_.radius.x * (2 * u.x - 1), settings_.radius.y * (2 * u.y - 1)};
    }
    return {look_up(inverse_x_, u.x), look_up(inverse_y_, u.y)};
}

}  // namespace lucerna
