#include "lights/measurement/exposure.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

constexpr double kNormalMad =
    1.482602218505602;  // standard deviation over median deviation of a normal variable
constexpr double kMedianLoss =
    1.5707963267948966;  // π/2: asymptotic variance of a median over that of a mean
constexpr double kWindow = 25;
constexpr double kClear = 3;  // standard deviations by which a count must be expected above black

}  // namespace

double CountNoise::variance(double signal, double dark) const {
    const double electrons = std::max(signal, 0.0) + std::max(dark, 0.0);
    return gain * electrons + read_noise * read_noise + step * step / 12;  // rounding is uniform in a step
}

DarkFrame dark_frame(std::span<const std::vector<float>> frames, const V2i& size, const CountNoise& noise,
                     double pedestal, const Workers& workers) {
    std::vector<float> mean(frames.front().size());
    const auto count = static_cast<double>(frames.size());
    for (std::size_t i = 0; i < mean.size(); ++i) {
        double sum = 0;
        for (const auto& frame : frames) sum += double{frame[i]};
        mean[i] = static_cast<float>(sum / count);
    }
    DarkFrame dark;
    dark.level = median_5x5(mean, size, workers);
    std::vector<float> off(mean.size());
    for (std::size_t i = 0; i < off.size(); ++i) off[i] = std::fabs(mean[i] - dark.level[i]);
    std::vector<float> reordered = off;
    const double deviation = kNormalMad * double{median_of(reordered)};
    const double limit = std::max(kHotDeviations * deviation, 1.5 * noise.step);
    dark.variance.assign(mean.size(), static_cast<float>(kMedianLoss / kWindow * deviation * deviation));
    for (std::size_t i = 0; i < off.size(); ++i) {
        if (!(double{off[i]} > limit)) continue;
        dark.hot.push_back(static_cast<std::uint32_t>(i));
        dark.level[i] = mean[i];
        dark.variance[i] = static_cast<float>(noise.variance(0, double{mean[i]} - pedestal) / count);
    }
    return dark;
}

DarkFrame flat_dark(const V2i& size, float level) {
    const auto pixels = static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y);
    return {std::vector<float>(pixels, level), std::vector<float>(pixels), {}};
}

void mend(std::vector<float>& image, const V2i& size, std::span<const std::uint32_t> pixels) {
    const auto good = [&](std::size_t i) {
        return !std::binary_search(pixels.begin(), pixels.end(), static_cast<std::uint32_t>(i));
    };
    // Pixels to be mended are not used as neighbours, so their order does not matter.
    for (const std::uint32_t i : pixels) {
        const V2i at(static_cast<int>(i % static_cast<std::uint32_t>(size.x)),
                     static_cast<int>(i / static_cast<std::uint32_t>(size.x)));
        image[i] = median_around(image, size, at, image[i], good);
    }
}

namespace {

struct Estimate {
    double rate = 0, variance = 0;
    bool saturated = false;
};

// Merges all exposures of one pixel.
class PixelMerge {
  public:
    PixelMerge(std::span<const Exposure> exposures, const CountNoise& noise, std::size_t pixel)
        : exposures_(exposures), noise_(noise), i_(pixel) {}

    Estimate operator()() const {
        std::size_t longest = exposures_.size();
        while (longest > 0 && double{count(longest - 1)} >= noise_.saturated) --longest;
        if (longest == 0) return bound();
        // The longest exposure that is not full knows the signal best, so it predicts the others' noise.
        const Exposure& best = exposures_[longest - 1];
        const double guess = (double{count(longest - 1)} - double{best.dark[i_]}) / best.seconds;
        double weights = 0, sum = 0, sum_variance = 0;
        for (std::size_t e = 0; e < longest; ++e) {
            const bool is_best = e + 1 == longest;
            if (!is_best && !clear_of_black(exposures_[e], guess)) continue;
            const double t = exposures_[e].seconds;
            const double variance = variance_of(exposures_[e], guess);
            // A count of variance 0 (floats without noise or light) is weighted by its time alone.
            const double weight = variance > 0 ? t * t / variance : t * t;
            weights += weight;
            sum += weight * (double{count(e)} - double{exposures_[e].dark[i_]}) / t;
            sum_variance += weight * weight * variance / (t * t);
        }
        return {sum / weights, sum_variance / (weights * weights), false};  // best has weight > 0
    }

  private:
    float count(std::size_t e) const { return exposures_[e].counts[i_]; }

    double variance_of(const Exposure& exposure, double rate) const {
        return noise_.variance(rate * exposure.seconds, double{exposure.dark[i_]} - exposure.pedestal) +
               double{exposure.dark_variance[i_]};
    }
    // Where a count may be clipped at black, its mean is not the signal.
    bool clear_of_black(const Exposure& exposure, double rate) const {
        const double expected = double{exposure.dark[i_]} + std::max(rate, 0.0) * exposure.seconds;
        return expected - kClear * std::sqrt(variance_of(exposure, rate)) > noise_.black;
    }
    Estimate bound() const {
        const Exposure& shortest = exposures_.front();
        const double rate = (double{count(0)} - double{shortest.dark[i_]}) / shortest.seconds;
        return {rate, variance_of(shortest, rate) / (shortest.seconds * shortest.seconds), true};
    }

    std::span<const Exposure> exposures_;
    const CountNoise& noise_;
    std::size_t i_;
};

}  // namespace

MergedExposures merge_exposures(std::span<const Exposure> exposures, const CountNoise& noise) {
    MergedExposures merged;
    const std::size_t pixels = exposures.front().counts.size();
    merged.rate.reserve(pixels);
    merged.variance.reserve(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const Estimate estimate = PixelMerge(exposures, noise, i)();
        merged.rate.push_back(static_cast<float>(estimate.rate));
        merged.variance.push_back(static_cast<float>(estimate.variance));
        if (estimate.saturated) merged.saturated.push_back(static_cast<std::uint32_t>(i));
    }
    return merged;
}

float median_of(std::span<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) return *middle;
    return 0.5F * (*std::max_element(values.begin(), middle) + *middle);
}

std::vector<float> median_5x5(std::span<const float> image, const V2i& size, const Workers& workers) {
    std::vector<float> medians(image.size());
    parallel_chunks(workers, size.y, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < size.x; ++x) {
            medians[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                    static_cast<std::size_t>(x)] =
                median_around(image, size, {x, y}, 0, [](std::size_t) { return true; });
        }
    });
    return medians;
}

}  // namespace lucerna
