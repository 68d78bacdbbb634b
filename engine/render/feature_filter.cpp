#include "engine/render/feature_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "engine/base/vec.h"
#include "engine/denoise/denoise.h"

namespace lucerna {
namespace {

constexpr float kAlbedoAdded = 0.01F;

// Differences of features that count as one: squares, and for the plane the squared sine of an angle.
constexpr float kNormals = 0.1F, kPlane = 0.05F, kEmitters = 0.1F, kAlbedos = 0.3F;

// Returns the power of albedo that a channel is proportional to, and which of R, G, B it is.
struct OfAlbedo {
    int power = 0, component = 0;
};
OfAlbedo of_albedo(const std::string& channel) {
    const std::size_t component = std::string("RGB").find(channel.empty() ? ' ' : channel.back());
    if (component == std::string::npos) return {};
    const bool is_square = channel.find("variance.") != std::string::npos;
    return {is_square ? 2 : 1, static_cast<int>(component)};
}

}  // namespace

FeatureFilter::FeatureFilter(const Film& film, int spacing, const Image& features, const Workers& workers)
    : size_(film.width(), film.height()),
      sampled_(static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y)),
      spacing_(spacing),
      features_(features),
      has_features_(!features.data.empty()),
      workers_(workers.alone()) {
    for (int y = 0; y < size_.y; ++y) {
        for (int x = 0; x < size_.x; ++x) sampled_[place(x, y)] = film.has_sample(x, y);
    }
}

// Returns a weight in (0, 1]: 1 if both pixels see the same plane of the same material.
float FeatureFilter::alike(std::size_t p, std::size_t q) const {
    // Light from afar counts where there is no other.
    constexpr float kLeast = 1e-5F;
    if (!has_features_) return 1;
    const float* const f = &features_.data[kFeatureChannels * p];
    const float* const g = &features_.data[kFeatureChannels * q];
    const auto difference = [f, g](int channel) {
        return V3f(g[channel] - f[channel], g[channel + 1] - f[channel + 1], g[channel + 2] - f[channel + 2]);
    };
    float apart = difference(kNormal).length2() / kNormals + sqr(g[kEmitter] - f[kEmitter]) / kEmitters +
                  difference(kAlbedo).length2() / kAlbedos;
    const V3f between = difference(kPosition);
    const float distance2 = between.length2();
    const V3f n(f[kGeometricNormal], f[kGeometricNormal + 1], f[kGeometricNormal + 2]);
    if (distance2 > 0) apart += sqr(n.dot(between)) / (distance2 * kPlane);
    return std::max(kLeast, 1 / sqr(sqr(1 + apart)));
}

Rgb FeatureFilter::albedo(std::size_t pixel) const {
    if (!has_features_) return Rgb(1.0F);
    const float* const f = &features_.data[kFeatureChannels * pixel + kAlbedo];
    return Rgb(f[0] + kAlbedoAdded, f[1] + kAlbedoAdded, f[2] + kAlbedoAdded);
}

template <typename Tap>
void FeatureFilter::for_each_sample(const V2i& at, Tap&& tap) const {
    const std::size_t p = place(at.x, at.y);
    // Samples stand on a lattice, and in some tiles on one of half the spacing.
    const int step = std::max(1, spacing_ / 2), reach = 2 * spacing_;
    const auto first = [step, reach](int x) { return std::max(0, (x - reach + step) / step * step); };
    for (int y = first(at.y); y < std::min(at.y + reach, size_.y); y += step) {
        for (int x = first(at.x); x < std::min(at.x + reach, size_.x); x += step) {
            const std::size_t q = place(x, y);
            if (!sampled_[q]) continue;
            const int dx = std::abs(x - at.x), dy = std::abs(y - at.y);
            const float tent =
                static_cast<float>((reach - dx) * (reach - dy)) / static_cast<float>(reach * reach);
            if (tent > 0) tap(q, tent * alike(p, q));
        }
    }
}

void FeatureFilter::fill(Image& image) const {
    if (std::find(sampled_.begin(), sampled_.end(), false) == sampled_.end()) return;
    const std::size_t width = image.channels.size();
    std::vector<OfAlbedo> powers;
    std::vector<std::size_t> filled;
    for (std::size_t c = 0; c < width; ++c) {
        powers.push_back(of_albedo(image.channels[c]));
        if (!image.channels[c].ends_with("samples")) filled.push_back(c);
    }
    parallel_chunks(workers_, size_.y, [&](std::int64_t row) {
        std::vector<double> sums(width);
        for (int x = 0; x < size_.x; ++x) {
            const V2i at(x, static_cast<int>(row));
            const std::size_t p = place(at.x, at.y);
            if (sampled_[p]) continue;
            std::fill(sums.begin(), sums.end(), 0.0);
            double weights = 0;
            const Rgb own = albedo(p);
            for_each_sample(at, [&](std::size_t q, float weight) {
                const Rgb ratio = own / albedo(q);
                const std::array<Rgb, 3> factors{Rgb(1.0F), ratio, ratio * ratio};
                weights += double{weight};
                for (const std::size_t c : filled) {
                    const auto& [power, component] = powers[c];
                    const float factor = factors[static_cast<std::size_t>(power)][component];
                    sums[c] += double{weight} * double{factor} * double{image.data[width * q + c]};
                }
            });
            if (!(weights > 0)) continue;
            for (const std::size_t c : filled)
                image.data[width * p + c] = static_cast<float>(sums[c] / weights);
        }
    });
}

// Limits each pixel to the second largest luminance among itself and the samples around it: a sample that is
// brighter than all of these would become a bright spot.
std::vector<Rgb> FeatureFilter::without_fireflies(const std::vector<Rgb>& light) const {
    std::vector<Rgb> limited = light;
    parallel_chunks(workers_, size_.y, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        for (int x = 0; x < size_.x; ++x) {
            float largest = -INFINITY, second = -INFINITY;
            for (int v = std::max(0, y - spacing_); v < std::min(y + spacing_ + 1, size_.y); v += spacing_) {
                for (int u = std::max(0, x - spacing_); u < std::min(x + spacing_ + 1, size_.x);
                     u += spacing_) {
                    const float l = luminance(light[place(u, v)]);
                    second = std::max(second, std::min(l, largest));
                    largest = std::max(largest, l);
                }
            }
            const float own = luminance(light[place(x, y)]);
            if (own > second && second > 0) limited[place(x, y)] *= second / own;
        }
    });
    return limited;
}

// Makes one level of the wavelet transform, with taps `step` pixels apart.
std::vector<Rgb> FeatureFilter::pass(const std::vector<Rgb>& light, int step) const {
    constexpr std::array<float, 3> kSpline{0.375F, 0.25F, 0.0625F};  // cubic B-spline
    std::vector<Rgb> result(light.size());
    parallel_chunks(workers_, size_.y, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        for (int x = 0; x < size_.x; ++x) {
            const std::size_t p = place(x, y);
            Rgb sum(0.0F);
            float weights = 0;
            for (int j = -2; j <= 2; ++j) {
                const int v = y + j * step;
                if (v < 0 || v >= size_.y) continue;
                for (int i = -2; i <= 2; ++i) {
                    const int u = x + i * step;
                    if (u < 0 || u >= size_.x) continue;
                    const std::size_t q = place(u, v);
                    const float weight = kSpline[static_cast<std::size_t>(std::abs(i))] *
                                         kSpline[static_cast<std::size_t>(std::abs(j))] * alike(p, q);
                    sum += weight * light[q];
                    weights += weight;
                }
            }
            result[p] = sum / weights;
        }
    });
    return result;
}

Image FeatureFilter::smooth(const Image& image) const {
    constexpr int kPasses = 2;
    const std::size_t width = image.channels.size();
    std::vector<Rgb> light(sampled_.size());
    for (std::size_t p = 0; p < light.size(); ++p) {
        const float* const rgb = &image.data[width * p];
        light[p] = Rgb(rgb[0], rgb[1], rgb[2]) / albedo(p);
    }
    light = without_fireflies(light);
    for (int i = 0; i < kPasses; ++i) light = pass(light, spacing_ << i);
    // Steps of several pixels leave a pattern of the lattice.
    if (spacing_ > 1) light = pass(light, 1);
    Image smoothed(size_.x, size_.y, {"R", "G", "B"});
    smoothed.space = image.space;
    for (std::size_t p = 0; p < light.size(); ++p) {
        const Rgb rgb = light[p] * albedo(p);
        for (int c = 0; c < 3; ++c) smoothed.data[3 * p + static_cast<std::size_t>(c)] = rgb[c];
    }
    return smoothed;
}

}  // namespace lucerna
