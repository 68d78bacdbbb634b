#include "engine/render/feature_filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "engine/base/vec.h"

namespace lucerna {
namespace {

constexpr float kAlbedoAdded = 0.01F;

// Differences of features that count as one: squares, and for the plane the squared sine of an angle.
constexpr float kNormals = 0.1F, kPlane = 0.05F, kEmitters = 0.1F, kAlbedos = 0.3F;

}  // namespace

// Counts, which are not filled, have the power -1.
FeatureFilter::OfAlbedo FeatureFilter::of_albedo(const std::string& channel) {
    if (channel.ends_with("samples")) return {-1, 0};
    const std::size_t component = std::string("RGB").find(channel.empty() ? ' ' : channel.back());
    if (component == std::string::npos) return {};
    const bool is_square = channel.find("variance.") != std::string::npos;
    return {is_square ? 2 : 1, static_cast<int>(component)};
}

FeatureFilter::FeatureFilter(const V2i& size, std::vector<std::uint8_t> sampled, int spacing,
                             const Image& features, const Workers& workers)
    : size_(size),
      sampled_(std::move(sampled)),
      spacing_(spacing),
      features_(features),
      has_features_(!features.data.empty()),
      workers_(workers.alone()) {}

// Returns a weight in (0, 1] of pixels by their features: 1 if both see the same plane of the same material.
inline float FeatureFilter::alike(const float* f, const float* g) {
    // Light from afar counts where there is no other.
    constexpr float kLeast = 1e-5F;
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
    const float share = 1 / static_cast<float>(reach * reach);
    for (int y = first(at.y); y < std::min(at.y + reach, size_.y); y += step) {
        const int rows = reach - std::abs(y - at.y);
        for (int x = first(at.x); x < std::min(at.x + reach, size_.x); x += step) {
            const std::size_t q = place(x, y);
            if (!sampled_[q]) continue;
            const int tent = rows * (reach - std::abs(x - at.x));
            if (tent > 0)
                tap(q, share * static_cast<float>(tent) *
                           (has_features_ ? alike(features_of(p), features_of(q)) : 1));
        }
    }
}

// Calls body(channel, factor) for the channels that are filled: light is proportional to the factor.
template <typename Body>
void FeatureFilter::for_each_channel(const std::vector<OfAlbedo>& channels, std::size_t pixel,
                                     Body&& body) const {
    const Rgb own = albedo(pixel);
    const std::array<Rgb, 3> factors{Rgb(1.0F), own, own * own};
    for (std::size_t c = 0; c < channels.size(); ++c) {
        const auto& [power, component] = channels[c];
        if (power >= 0) body(c, factors[static_cast<std::size_t>(power)][component]);
    }
}

// Divides the channels of sampled pixels by their factors.
ZeroedVector<float> FeatureFilter::divided(const Image& image, const std::vector<OfAlbedo>& channels) const {
    const std::size_t width = channels.size();
    ZeroedVector<float> result(image.data.size());
    parallel_chunks(workers_, size_.y, [&](std::int64_t row) {
        for (std::size_t p = place(0, static_cast<int>(row)); p < place(0, static_cast<int>(row) + 1); ++p) {
            if (!sampled_[p]) continue;
            for_each_channel(channels, p, [&](std::size_t c, float factor) {
                // The albedo has kAlbedoAdded, so that the factor is above 0.
                result[width * p + c] = image.data[width * p + c] / factor;
            });
        }
    });
    return result;
}

void FeatureFilter::fill(const std::vector<Image*>& images) const {
    if (std::find(sampled_.begin(), sampled_.end(), 0) == sampled_.end()) return;
    struct Part {
        Image& image;
        std::vector<OfAlbedo> channels;
        ZeroedVector<float> divided;
    };
    std::vector<Part> parts;
    std::size_t all = 0;
    for (Image* const image : images) {
        std::vector<OfAlbedo> channels;
        for (const std::string& name : image->channels) channels.push_back(of_albedo(name));
        ZeroedVector<float> light = divided(*image, channels);
        all += channels.size();
        parts.push_back({*image, std::move(channels), std::move(light)});
    }
    parallel_chunks(workers_, size_.y, [&](std::int64_t row) {
        std::vector<float> sums(all);
        for (int x = 0; x < size_.x; ++x) {
            const V2i at(x, static_cast<int>(row));
            const std::size_t p = place(at.x, at.y);
            if (sampled_[p]) continue;
            std::fill(sums.begin(), sums.end(), 0.0F);
            float weights = 0;
            for_each_sample(at, [&](std::size_t q, float weight) {
                weights += weight;
                float* sum = sums.data();
                for (const Part& part : parts) {
                    const std::size_t width = part.channels.size();
                    const float* const from = &part.divided[width * q];
                    for (std::size_t c = 0; c < width; ++c) sum[c] += weight * from[c];
                    sum += width;
                }
            });
            if (!(weights > 0)) continue;
            const float* sum = sums.data();
            for (const Part& part : parts) {
                const std::size_t width = part.channels.size();
                for_each_channel(part.channels, p, [&](std::size_t c, float factor) {
                    part.image.data[width * p + c] = factor * (sum[c] / weights);
                });
                sum += width;
            }
        }
    });
}

std::vector<std::uint8_t> sampled_pixels(const Film& film, const Workers& workers) {
    const auto width = static_cast<std::size_t>(film.width());
    std::vector<std::uint8_t> sampled(width * static_cast<std::size_t>(film.height()));
    parallel_chunks(workers.alone(), film.height(), [&](std::int64_t row) {
        std::uint8_t* const to = &sampled[static_cast<std::size_t>(row) * width];
        for (int x = 0; x < film.width(); ++x) to[x] = film.has_sample(x, static_cast<int>(row)) ? 1 : 0;
    });
    return sampled;
}

void complete_halves(std::array<Image, 2>& halves, int spacing, const Image& features,
                     const Workers& workers) {
    const V2i size(halves[0].width, halves[0].height);
    const auto width = static_cast<std::size_t>(size.x);
    std::array<std::vector<std::uint8_t>, 2> sampled;
    for (auto& of_half : sampled) of_half.resize(width * static_cast<std::size_t>(size.y));
    parallel_chunks(workers.alone(), size.y, [&](std::int64_t row) {
        const auto y = static_cast<int>(row);
        for (int x = 0; x < size.x; ++x) {
            float& a = halves[0].value(x, y, kSamples);
            float& b = halves[1].value(x, y, kSamples);
            // A half without samples of a pixel shows the light of the other.
            if (((x / spacing + y / spacing) & 1) == 1 && (a == 0 || b == 0)) std::swap(a, b);
            const std::size_t at = width * static_cast<std::size_t>(y) + static_cast<std::size_t>(x);
            sampled[0][at] = a > 0 ? 1 : 0, sampled[1][at] = b > 0 ? 1 : 0;
        }
    });
    for (std::size_t half = 0; half < 2; ++half) {
        FeatureFilter(size, std::move(sampled[half]), spacing, features, workers).fill({&halves[half]});
    }
}

}  // namespace lucerna
