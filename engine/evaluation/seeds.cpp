#include "engine/evaluation/seeds.h"

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/base/vec.h"
#include "engine/evaluation/compare.h"

namespace lucerna {
namespace {

// Accumulates G_ij; means() divides the sums at the end.
class Gram {
  public:
    explicit Gram(std::size_t images) : n_(images), sums_(images * images) {}

    void add(const std::vector<double>& differences, double weight) {
        for (std::size_t i = 0; i < n_; ++i) {
            const double weighted = weight * differences[i];
            for (std::size_t j = i; j < n_; ++j) sums_[i * n_ + j] += weighted * differences[j];
        }
    }
    double at(std::size_t i, std::size_t j) const { return sums_[std::min(i, j) * n_ + std::max(i, j)]; }

    // Means of the diagonal and of the other elements, excluding image `without` (n: none excluded).
    struct Means {
        double own = 0, others = 0;
    };
    Means means(std::size_t without) const {
        Means means;
        double own = 0, pairs = 0;
        for (std::size_t i = 0; i < n_; ++i) {
            if (i == without) continue;
            means.own += at(i, i);
            ++own;
            for (std::size_t j = i + 1; j < n_; ++j) {
                if (j == without) continue;
                means.others += at(i, j);
                ++pairs;
            }
        }
        if (own > 0) means.own /= own;
        if (pairs > 0) means.others /= pairs;
        return means;
    }

  private:
    std::size_t n_;
    std::vector<double> sums_;
};

// Returns Tukey's jackknife variance from n > 0 values, each without one of the images.
double jackknife_variance(const std::vector<double>& values) {
    RunningStats stats;
    for (const double v : values) stats.add(v);
    const double n = static_cast<double>(values.size());
    return sqr(n - 1) / n * stats.variance();
}

// Sums over all values for one weighting.
struct PartSums {
    Gram gram;
    double reference_variance = 0;  // Σ w v_r
    double reference_scatter = 0;   // Σ w² Var((ε_r + b)²), see add()

    explicit PartSums(std::size_t images) : gram(images) {}

    // `between` is s²/n of the images at this value.
    void add(const std::vector<double>& differences, double weight, double mean, double between,
             double variance) {
        gram.add(differences, weight);
        reference_variance += weight * variance;
        // For bias b and the reference's noise ε of variance v, Var (b - ε)² = 4 b² v + 2 v², and mean² -
        // between has the expectation b² + v.
        reference_scatter += sqr(weight) * (4 * (sqr(mean) - between) * variance - 2 * sqr(variance));
    }

    ErrorParts parts(std::size_t images, double values, double channels) const {
        ErrorParts parts;
        const Gram::Means all = gram.means(images);
        parts.reference_noise2 = reference_variance / values;
        parts.mse.value = all.own / values;
        parts.bias2.value = all.others / values - parts.reference_noise2;
        parts.noise2.value = (all.own - all.others) / values;
        std::vector<double> mse, bias, noise;
        for (std::size_t i = 0; i < images; ++i) {
            const Gram::Means rest = gram.means(i);
            mse.push_back(rest.own / values);
            bias.push_back(rest.others / values);
            noise.push_back((rest.own - rest.others) / values);
        }
        parts.mse.error = std::sqrt(jackknife_variance(mse));
        if (images < 3) return parts;  // without one of two images no pair is left
        // Channels may be fully correlated: the variance of a sum of C terms is at most C times the sum of
        // their variances.
        const double scatter = std::max(0.0, channels * reference_scatter / sqr(values));
        parts.bias2.error = std::sqrt(jackknife_variance(bias) + scatter);
        parts.noise2.error = std::sqrt(jackknife_variance(noise));
        return parts;
    }
};

class SeedStudy {
  public:
    SeedStudy(std::span<const NamedImage> images, const NamedImage& reference, double mask_above)
        : images_(images),
          reference_(reference.image),
          mask_above_(mask_above),
          absolute_(images.size()),
          relative_(images.size()),
          differences_(images.size()) {
        for (const NamedImage& one : images)
            shared_.push_back(shared_channels(one.image, reference.image, one.name, reference.name));
        for (std::size_t i = 1; i < shared_.size(); ++i) {
            if (shared_[i].size() == shared_[0].size() &&
                std::equal(shared_[i].begin(), shared_[i].end(), shared_[0].begin(),
                           [](const SharedChannel& a, const SharedChannel& b) { return a.name == b.name; }))
                continue;
            throw InputError({images[i].name}, "its channels differ from those of " + images[0].name +
                                                   "; images of one render must have the same channels");
        }
        values_.assign(images.size(), std::vector<double>(shared_[0].size()));
        reference_values_.resize(shared_[0].size());
        result_.reference_has_variance =
            std::all_of(shared_[0].begin(), shared_[0].end(),
                        [](const SharedChannel& c) { return c.reference_variance_at.has_value(); });
        stated_ = std::all_of(shared_.begin(), shared_.end(), [](const auto& channels) {
            return std::all_of(channels.begin(), channels.end(),
                               [](const SharedChannel& c) { return c.variance_at.has_value(); });
        });
    }

    BiasAndNoise run() {
        const std::size_t pixels =
            static_cast<std::size_t>(reference_.width) * static_cast<std::size_t>(reference_.height);
        for (std::size_t i = 0; i < pixels; ++i) pixel(i);
        finish();
        return std::move(result_);
    }

  private:
    const float* values_of(std::size_t image, std::size_t pixel) const {
        const Image& one = images_[image].image;
        return &one.data[pixel * one.channels.size()];
    }

    void pixel(std::size_t at) {
        const float* r = &reference_.data[at * reference_.channels.size()];
        for (std::size_t i = 0; i < images_.size(); ++i) {
            if (!pixel_state(values_of(i, at), r, shared_[i], mask_above_).compared()) return;
        }
        ++result_.pixels;
        for (std::size_t c = 0; c < shared_[0].size(); ++c) value(at, c, r);
    }

    void value(std::size_t at, std::size_t c, const float* reference) {
        const double r = double{reference[shared_[0][c].reference_at]};
        RunningStats stats;
        for (std::size_t i = 0; i < images_.size(); ++i) {
            const float* t = values_of(i, at);
            const SharedChannel& channel = shared_[i][c];
            differences_[i] = double{t[channel.at]} - r;
            stats.add(differences_[i]);
            values_[i][c] += double{t[channel.at]};
            if (stated_) stated_variance_ += finite_or_zero(t[*channel.variance_at]);
        }
        const double variance = result_.reference_has_variance
                                    ? finite_or_zero(reference[*shared_[0][c].reference_variance_at])
                                    : 0;
        reference_values_[c] += r;
        actual_variance_ += stats.variance();
        const double between = stats.variance() / static_cast<double>(images_.size());
        absolute_.add(differences_, 1, stats.mean(), between, variance);
        relative_.add(differences_, 1 / (r * r + kRelativeMseFloor), stats.mean(), between, variance);
    }

    static double finite_or_zero(float v) { return std::isfinite(v) ? double{v} : 0; }

    void finish() {
        result_.images = images_.size();
        count_equal();
        if (result_.pixels == 0) return;
        const double pixels = static_cast<double>(result_.pixels);
        const double channels = static_cast<double>(shared_[0].size());  // at least one
        result_.absolute = absolute_.parts(images_.size(), pixels * channels, channels);
        result_.relative = relative_.parts(images_.size(), pixels * channels, channels);
        for (std::size_t c = 0; c < shared_[0].size(); ++c) {
            RunningStats means;
            for (const std::vector<double>& values : values_) means.add(values[c] / pixels);
            ChannelOfSeeds channel{shared_[0][c].name,
                                   {means.mean(), means.standard_error()},
                                   reference_values_[c] / pixels,
                                   {}};
            const double r = channel.reference_mean;
            if (r != 0) channel.ratio = {means.mean() / r, means.standard_error() / std::fabs(r)};
            result_.channels.push_back(std::move(channel));
        }
        if (stated_ && actual_variance_ > 0)
            result_.stated_over_actual =
                stated_variance_ / static_cast<double>(images_.size()) / actual_variance_;
    }

    void count_equal() {
        for (std::size_t i = 0; i < images_.size(); ++i) {
            for (std::size_t j = i + 1; j < images_.size(); ++j)
                result_.equal_pairs += images_[i].image.data == images_[j].image.data;
        }
    }

    std::span<const NamedImage> images_;
    const Image& reference_;
    double mask_above_;
    std::vector<std::vector<SharedChannel>> shared_;  // per image
    PartSums absolute_, relative_;
    std::vector<double> differences_;          // of one value, per image
    std::vector<std::vector<double>> values_;  // sums, per image and channel
    std::vector<double> reference_values_;     // sums, per channel
    bool stated_ = false;
    double stated_variance_ = 0, actual_variance_ = 0;
    BiasAndNoise result_;
};

// Calls use(c, values) with the images' values for every channel of the first image and every pixel.
template <typename Use>
void for_all_values(std::span<const NamedImage> images, Use&& use) {
    const Image& first = images[0].image;
    for (const NamedImage& one : images) {
        if (one.image.width != first.width || one.image.height != first.height)
            input_error({one.name}, "{} x {} pixels, but {} has {} x {}", one.image.width, one.image.height,
                        images[0].name, first.width, first.height);
    }
    const std::size_t pixels = static_cast<std::size_t>(first.width) * static_cast<std::size_t>(first.height);
    std::vector<float> values(images.size());
    for (std::size_t c = 0; c < first.channels.size(); ++c) {
        std::vector<std::size_t> at;
        for (const NamedImage& one : images) {
            const auto found = find_channel(one.image, first.channels[c]);
            if (!found)
                input_error({one.name}, "has no channel {}, as {} does", first.channels[c], images[0].name);
            at.push_back(*found);
        }
        for (std::size_t p = 0; p < pixels; ++p) {
            for (std::size_t i = 0; i < images.size(); ++i)
                values[i] = images[i].image.data[p * images[i].image.channels.size() + at[i]];
            use(p, c, values);
        }
    }
}

}  // namespace

BiasAndNoise bias_and_noise(std::span<const NamedImage> images, const NamedImage& reference,
                            double mask_above) {
    if (images.size() < 2) throw InputError("at least two images are needed to separate bias from noise");
    return SeedStudy(images, reference, mask_above).run();
}

Image mean_image(std::span<const NamedImage> images) {
    Image mean = images[0].image;
    if (images.size() == 1) return mean;
    const double n = static_cast<double>(images.size());
    for_all_values(images, [&](std::size_t p, std::size_t c, const std::vector<float>& values) {
        double sum = 0;
        for (const float v : values) sum += double{v};
        const bool variance = mean.channels[c].starts_with("variance.");
        mean.data[p * mean.channels.size() + c] = static_cast<float>(variance ? sum / (n * n) : sum / n);
    });
    return mean;
}

Image noise_image(std::span<const NamedImage> images) {
    const Image& first = images[0].image;
    Image noise(first.width, first.height, first.channels);
    for_all_values(images, [&](std::size_t p, std::size_t c, const std::vector<float>& values) {
        RunningStats stats;
        for (const float v : values) stats.add(double{v});
        noise.data[p * noise.channels.size() + c] = static_cast<float>(std::sqrt(stats.variance()));
    });
    return noise;
}

}  // namespace lucerna
