#include "engine/render/film.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "engine/base/error.h"

namespace lucerna {
namespace {

constexpr std::size_t kSteps = 1024;

double sinc(double x) {
    const double at = M_PI * std::fabs(x);
    return at < 1e-5 ? 1 : std::sin(at) / at;
}

// Mitchell, Netravali 1988, over [-2, 2].
double mitchell(double x, double b, double c) {
    x = std::fabs(x);
    if (x >= 2) return 0;
    if (x >= 1) {
        return ((-b - 6 * c) * x * x * x + (6 * b + 30 * c) * x * x + (-12 * b - 48 * c) * x +
                (8 * b + 24 * c)) /
               6;
    }
    return ((12 - 9 * b - 6 * c) * x * x * x + (-18 + 12 * b + 6 * c) * x * x + (6 - 2 * b)) / 6;
}

// One axis of the filter at x in [-radius, radius], as pbrt defines it.
double filter_value(const FilterSettings& s, double x, double radius) {
    switch (s.kind) {
        case FilterSettings::Kind::box:
            return 1;
        case FilterSettings::Kind::triangle:
            return radius - std::fabs(x);
        case FilterSettings::Kind::gaussian: {
            // Lowered so that it reaches 0 at the radius.
            const double two_variance = 2 * sqr(static_cast<double>(s.sigma));
            return std::exp(-x * x / two_variance) - std::exp(-radius * radius / two_variance);
        }
        case FilterSettings::Kind::mitchell:
            return mitchell(2 * x / radius, static_cast<double>(s.b), static_cast<double>(s.c));
        case FilterSettings::Kind::sinc:
            return sinc(x) * sinc(x / static_cast<double>(s.tau));
    }
    return 0;
}

// Welford's step, on the root of the sum: before and after have one sign, so that their product is a square.
void widen(V3f& spread, const V3f& before, const V3f& after) {
    for (int c = 0; c < 3; ++c) {
        spread[c] = static_cast<float>(
            std::sqrt(sqr(double{spread[c]}) + std::max(0.0, double{before[c]} * double{after[c]})));
    }
}

V3d squared(const V3f& v) {
    return V3d(v) * V3d(v);
}

}  // namespace

void Film::add(int x, int y, const Rgb& radiance, float weight) {
    Pixel& pixel =
        pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
    ++pixel.count;
    const auto n = static_cast<float>(pixel.count);
    const V3f delta = radiance - pixel.mean;
    pixel.mean += delta / n;
    widen(pixel.spread, delta, radiance - pixel.mean);
    const float lean = weight - pixel.weight;
    pixel.weight += lean / n;
    pixel.together += lean * (radiance - pixel.mean);
}

void Film::add_pass(int x, int y, std::span<const Sample> samples) {
    if (samples.empty()) return;
    const std::size_t place =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    const auto n = static_cast<float>(samples.size());
    // The pass's own E[wL], measured from what is known of L so far: as E[w] = 1 that has no bias, and
    // nothing varies where L does not.
    V3f centre = pixels_[place].mean;
    if (pixels_[place].count == 0) {
        for (const Sample& sample : samples) centre += sample.radiance / n;
    }
    V3f value = centre;
    for (const Sample& sample : samples) value += sample.weight * (sample.radiance - centre) / n;
    Passes& passes = passes_[place];
    ++passes.count;
    const V3f delta = value - passes.mean;
    passes.mean += delta / static_cast<float>(passes.count);
    widen(passes.spread, delta, value - passes.mean);

    for (const Sample& sample : samples) add(x, y, sample.radiance, sample.weight);
}

V3f Film::value(const Pixel& pixel) const {
    return pixel.count > 1 ? pixel.mean + pixel.together / static_cast<float>(pixel.count - 1) : pixel.mean;
}

V3d Film::variance(std::size_t place) const {
    if (!passes_.empty()) {
        const Passes& passes = passes_[place];
        const double n = passes.count;
        return passes.count > 1 ? squared(passes.spread) / ((n - 1) * n) : V3d(0.0);
    }
    const Pixel& pixel = pixels_[place];
    if (pixel.count < 2) return V3d(0.0);
    const double n = pixel.count;
    V3d variance;
    for (int c = 0; c < 3; ++c) {
        // Of w (L - mean L), whose mean is the covariance; too small by what the covariance itself scatters.
        const double covariance = double{pixel.together[c]} / (n - 1);
        variance[c] =
            std::max(0.0, double{weight2_} * sqr(double{pixel.spread[c]}) / (n - 1) - sqr(covariance)) / n;
    }
    return variance;
}

Image Film::develop(float scale) const {
    Image image(width_, height_, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        const V3f mean = value(pixels_[i]) * scale;
        const V3d spread = variance(i) * sqr(double{scale});
        for (int c = 0; c < 3; ++c) {
            image.data[6 * i + static_cast<std::size_t>(c)] = mean[c];
            constexpr double kLargest = std::numeric_limits<float>::max();
            image.data[6 * i + 3 + static_cast<std::size_t>(c)] =
                static_cast<float>(std::min(spread[c], kLargest));
        }
    }
    return image;
}

double Film::relative_error() const {
    constexpr double kFloor = 0.1;  // of the mean luminance
    double sum = 0;
    std::size_t known = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        const std::uint32_t count = passes_.empty() ? pixels_[i].count : passes_[i].count;
        if (count == 0) continue;  // none of its samples was finite
        if (count == 1) return INFINITY;
        ++known;
        sum += std::fabs(double{luminance(value(pixels_[i]))});
    }
    if (known == 0) return INFINITY;
    const double floor2 = sqr(kFloor * sum / static_cast<double>(known));

    double square = 0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
        const V3d spread = variance(i);
        const V3d deviation(std::sqrt(spread.x), std::sqrt(spread.y), std::sqrt(spread.z));
        const double error = double{luminance(Rgb(V3f(deviation)))};
        // Where something varies the divisor is above 0: a variance above 0 is one of values that are not all
        // 0.
        if (error > 0) square += sqr(error) / (sqr(double{luminance(value(pixels_[i]))}) + floor2);
    }
    return std::sqrt(square / static_cast<double>(known));
}

std::size_t Film::bytes_of_sums() const {
    return std::as_bytes(std::span(pixels_)).size() + std::as_bytes(std::span(passes_)).size();
}

std::vector<std::byte> Film::sums() const {
    std::vector<std::byte> sums;
    sums.reserve(bytes_of_sums());
    for (const auto bytes : {std::as_bytes(std::span(pixels_)), std::as_bytes(std::span(passes_))})
        sums.insert(sums.end(), bytes.begin(), bytes.end());
    return sums;
}

void Film::restore(std::span<const std::byte> sums) {
    assert(sums.size() == bytes_of_sums());
    for (const auto to :
         {std::as_writable_bytes(std::span(pixels_)), std::as_writable_bytes(std::span(passes_))}) {
        std::copy_n(sums.begin(), to.size(), to.begin());
        sums = sums.subspan(to.size());
    }
}

FilterSampler::FilterSampler(const FilterSettings& settings) : settings_(settings) {
    if (settings.kind == FilterSettings::Kind::box) return;
    x_ = axis(settings.radius.x);
    y_ = axis(settings.radius.y);
}

// In steps fine enough that nobody sees them: a thousandth of the filter's width.
FilterSampler::Axis FilterSampler::axis(float radius) const {
    Axis result;
    std::vector<double> weights(kSteps);
    double sum = 0;
    for (std::size_t i = 0; i < kSteps; ++i) {
        const double x = static_cast<double>(radius) * (2 * (static_cast<double>(i) + 0.5) / kSteps - 1);
        const double value = filter_value(settings_, x, static_cast<double>(radius));
        sum += value;
        weights[i] = std::fabs(value);
        result.negative.push_back(value < 0);
    }
    result.steps = Cdf(weights);
    // Far from 0, so that the division below stays small.
    if (!(sum > 0.05 * result.steps.total())) {
        throw InputError("this filter's negative lobes outweigh it; no picture can be made with it");
    }
    result.weight = static_cast<float>(result.steps.total() / sum);
    return result;
}

float FilterSampler::draw(const Axis& axis, float u, float radius, float& weight) {
    const Cdf::Draw step = axis.steps.draw(u);
    weight *= axis.negative[step.item] ? -axis.weight : axis.weight;
    return radius * (2 * (static_cast<float>(step.item) + step.remainder) / kSteps - 1);
}

FilterSampler::Sample FilterSampler::sample(const V2f& u) const {
    const V2f& radius = settings_.radius;
    if (settings_.kind == FilterSettings::Kind::box) {
        return {{radius.x * (2 * u.x - 1), radius.y * (2 * u.y - 1)}, 1};
    }
    Sample sample{{0, 0}, 1};
    sample.offset.x = draw(x_, u.x, radius.x, sample.weight);
    sample.offset.y = draw(y_, u.y, radius.y, sample.weight);
    return sample;
}

}  // namespace lucerna
