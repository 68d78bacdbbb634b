#include "engine/render/feature_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

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

FeatureFilter::FeatureFilter(const V2i& size, std::vector<bool> sampled, int spacing, const Image& features,
                             const Workers& workers)
    : size_(size),
      sampled_(std::move(sampled)),
      spacing_(spacing),
      features_(features),
      has_features_(!features.data.empty()),
      workers_(workers.alone()) {}

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

std::vector<bool> sampled_pixels(const Film& film) {
    std::vector<bool> sampled;
    sampled.reserve(static_cast<std::size_t>(film.width()) * static_cast<std::size_t>(film.height()));
    for (int y = 0; y < film.height(); ++y) {
        for (int x = 0; x < film.width(); ++x) sampled.push_back(film.has_sample(x, y));
    }
    return sampled;
}

void complete_halves(std::array<Image, 2>& halves, int spacing, const Image& features,
                     const Workers& workers) {
    const V2i size(halves[0].width, halves[0].height);
    std::array<std::vector<bool>, 2> sampled;
    std::array<bool, 2> is_complete{true, true};
    for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) {
            float& a = halves[0].value(x, y, kSamples);
            float& b = halves[1].value(x, y, kSamples);
            // A half without samples of a pixel shows the light of the other.
            if (((x / spacing + y / spacing) & 1) == 1 && (a == 0 || b == 0)) std::swap(a, b);
            sampled[0].push_back(a > 0), sampled[1].push_back(b > 0);
            is_complete[0] &= a > 0, is_complete[1] &= b > 0;
        }
    }
    for (std::size_t half = 0; half < 2; ++half) {
        if (is_complete[half]) continue;
        FeatureFilter(size, std::move(sampled[half]), spacing, features, workers).fill(halves[half]);
    }
}

}  // namespace lucerna
