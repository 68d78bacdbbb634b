#include "engine/render/film.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/base/cdf.h"
#include "engine/base/elementary.h"
#include "engine/base/error.h"
#include "engine/base/stats.h"
#include "engine/denoise/denoise.h"
#include "engine/image/image.h"

namespace lucerna {
namespace {

constexpr std::size_t kSteps = 1024;

double sinc(double x) {
    const double at = M_PI * std::fabs(x);
    return at < 1e-5 ? 1 : sin(at) / at;
}

// The filter of [Mitchell and Netravali 1988], over [-2, 2].
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

// Returns the filter along one axis at x in [-radius, radius], as pbrt defines it.
double filter_value(const FilterSettings& s, double x, double radius) {
    switch (s.kind) {
        case FilterSettings::Kind::box:
            return 1;
        case FilterSettings::Kind::triangle:
            return radius - std::fabs(x);
        case FilterSettings::Kind::gaussian: {
            // The Gaussian is lowered so that it reaches 0 at the radius.
            const double two_variance = 2 * sqr(static_cast<double>(s.sigma));
            return exp(-x * x / two_variance) - exp(-radius * radius / two_variance);
        }
        case FilterSettings::Kind::mitchell:
            return mitchell(2 * x / radius, static_cast<double>(s.b), static_cast<double>(s.c));
        case FilterSettings::Kind::sinc:
            return sinc(x) * sinc(x / static_cast<double>(s.tau));
    }
    return 0;
}

// Makes Welford's step on the root of the sum: `before` and `after` have the same sign, so their product is
// not negative.
void update_root_m2(V3f& root_m2, const V3f& before, const V3f& after) {
    for (int c = 0; c < 3; ++c) {
        root_m2[c] = static_cast<float>(
            std::sqrt(sqr(double{root_m2[c]}) + std::max(0.0, double{before[c]} * double{after[c]})));
    }
}

V3d squared(const V3f& v) {
    return V3d(v) * V3d(v);
}

}  // namespace

void Film::add_sample(Pixel& pixel, const Rgb& radiance, float weight) {
    ++pixel.count;
    const auto n = static_cast<float>(pixel.count);
    const V3f delta = radiance - pixel.mean;
    pixel.mean += delta / n;
    update_root_m2(pixel.root_m2, delta, radiance - pixel.mean);
    const float weight_delta = weight - pixel.weight;
    pixel.weight += weight_delta / n;
    pixel.covariance_sum += weight_delta * (radiance - pixel.mean);
}

void Film::update_half_buffers(std::size_t pixel) {
    if (kind_.two_halves || !std::has_single_bit(count(pixel))) return;
    half_buffers_[pixel] = {half_buffers_[pixel].last, static_cast<float>(shown(pixel))};
}

void Film::add(int x, int y, const Rgb& radiance, float weight, int half, float blur) {
    const std::size_t at = static_cast<std::size_t>(half) * size_ + place(x, y);
    add_sample(pixels_[at], radiance, weight);
    if (kind_.tells_blur) blur_[at] += weight * blur;
    update_half_buffers(place(x, y));
}

void Film::add_pass(int x, int y, std::span<const Sample> samples, int half) {
    if (samples.empty()) return;
    const std::size_t at = static_cast<std::size_t>(half) * size_ + place(x, y);
    Pixel& pixel = pixels_[at];
    const auto n = static_cast<float>(samples.size());
    // Estimates the pass's own E[wL] relative to the previous mean of L. As E[w] = 1 this adds no bias, and
    // there is no variance where L does not vary.
    V3f centre = pixel.mean;
    if (pixel.count == 0) {
        for (const Sample& sample : samples) centre += sample.radiance / n;
    }
    V3f value = centre;
    for (const Sample& sample : samples) value += sample.weight * (sample.radiance - centre) / n;
    Passes& passes = passes_[at];
    ++passes.count;
    const V3f delta = value - passes.mean;
    passes.mean += delta / static_cast<float>(passes.count);
    update_root_m2(passes.root_m2, delta, value - passes.mean);

    for (const Sample& sample : samples) add_sample(pixel, sample.radiance, sample.weight);
    if (kind_.tells_blur) {
        for (const Sample& sample : samples) blur_[at] += sample.weight * sample.blur;
    }
    update_half_buffers(place(x, y));
}

// Merges the sums of two sets of samples [Chan et al. 1983, (2.1)].
Film::Pixel Film::merged(const Pixel& a, const Pixel& b) {
    if (b.count == 0) return a;
    if (a.count == 0) return b;
    const double n_a = a.count, n_b = b.count;
    const double share = n_b / (n_a + n_b), both = n_a * share;
    Pixel sum;
    sum.count = a.count + b.count;
    const double weight_delta = double{b.weight} - double{a.weight};
    sum.weight = static_cast<float>(double{a.weight} + share * weight_delta);
    const V3d delta = V3d(b.mean) - V3d(a.mean);
    sum.mean = V3f(V3d(a.mean) + share * delta);
    sum.covariance_sum = V3f(V3d(a.covariance_sum) + V3d(b.covariance_sum) + both * weight_delta * delta);
    const V3d m2 = squared(a.root_m2) + squared(b.root_m2) + both * delta * delta;
    sum.root_m2 = V3f(V3d(std::sqrt(m2.x), std::sqrt(m2.y), std::sqrt(m2.z)));
    return sum;
}

Film::Passes Film::merged(const Passes& a, const Passes& b) {
    const Pixel sum = merged(Pixel{a.mean, a.root_m2, {0, 0, 0}, 0, a.count},
                             Pixel{b.mean, b.root_m2, {0, 0, 0}, 0, b.count});
    return {sum.mean, sum.root_m2, sum.count};
}

V3f Film::value(const Pixel& pixel) {
    return pixel.count > 1 ? pixel.mean + pixel.covariance_sum / static_cast<float>(pixel.count - 1)
                           : pixel.mean;
}

double Film::shown(std::size_t pixel) const {
    return double{luminance(value_at(pixel))};
}

Film::OfHalf Film::of_half(int x, int y, int half) const {
    const Pixel& pixel = pixels_[static_cast<std::size_t>(half) * size_ + place(x, y)];
    return {double{luminance(value(pixel))}, pixel.count * luminance_variance(variance(pixel))};
}

V3d Film::variance(const Passes& passes) {
    const double n = passes.count;
    return passes.count > 1 ? squared(passes.root_m2) / ((n - 1) * n) : V3d(0.0);
}

V3d Film::variance(const Pixel& pixel) const {
    if (pixel.count < 2) return V3d(0.0);
    const double n = pixel.count, weight2 = sqr(double{kind_.weight});
    V3d variance;
    for (int c = 0; c < 3; ++c) {
        // The variance of w (L - mean L) is its mean square less the square of its mean, the covariance of w
        // and L. An estimate of the latter from few samples is mostly noise, and may be as large as the
        // former, so only what exceeds four times the variance of that estimate is subtracted.
        const double of_light = sqr(double{pixel.root_m2[c]}) / (n - 1), square = weight2 * of_light;
        const double covariance = double{pixel.covariance_sum[c]} / (n - 1);
        const double of_product = square - std::max(0.0, sqr(covariance) - 4 * square / n);
        // The scatter of the mean weight adds to it.
        variance[c] = (of_product + (weight2 - 1) * of_light / (n - 1)) / n;
    }
    return variance;
}

int Film::spacing(const Workers& workers) const {
    std::vector<int> of_rows(static_cast<std::size_t>(height_), 1);
    for_each_row(workers, [&](int y) {
        int& spacing = of_rows[static_cast<std::size_t>(y)];
        for (int x = 0; x < width_; ++x) {
            if (!has_sample(x, y)) spacing = std::max(spacing, step_of({x, y}) == 2 ? 2 : 4);
        }
    });
    return of_rows.empty() ? 1 : *std::max_element(of_rows.begin(), of_rows.end());
}

void Film::store(const V3f& value, const V3d& variance, const V3f& scales, float* to) {
    constexpr double kLargest = std::numeric_limits<float>::max();
    const V3f mean = value * scales;
    const V3d scaled = variance * V3d(scales) * V3d(scales);
    for (int c = 0; c < 3; ++c) {
        to[c] = mean[c];
        to[3 + c] = static_cast<float>(std::min(scaled[c], kLargest));
    }
}

Image Film::develop(float scale, const WorkingSpace& colours, const Workers& workers) const {
    Image image(width_, height_, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    if (!colours.is_srgb()) image.space = &colours.space();
    const V3f scales = colours.light_to_rgb(Rgb(scale));
    for_each_row(workers, [&](int y) {
        for (std::size_t i = place(0, y); i < place(0, y + 1); ++i)
            store(value_at(i), variance(i), scales, &image.data[6 * i]);
    });
    return image;
}

Image Film::develop_half(int half, float scale, const WorkingSpace& colours, const Workers& workers) const {
    assert(kind_.two_halves);
    Image image(width_, height_, half_channels());
    if (!colours.is_srgb()) image.space = &colours.space();
    const V3f scales = colours.light_to_rgb(Rgb(scale));
    for_each_row(workers, [&](int y) {
        for (std::size_t i = place(0, y); i < place(0, y + 1); ++i) {
            // If this half has no sample yet, the pixel shows the other half's.
            const Pixel& of_half = pixels_[static_cast<std::size_t>(half) * size_ + i];
            const Pixel pixel = of_half.count > 0 ? of_half : whole(i);
            float* const to = &image.data[kHalfChannels * i];
            store(value(pixel), variance(pixel), scales, to);
            to[kSamples] = static_cast<float>(of_half.count);
        }
    });
    return image;
}

Film::Halves Film::halves(std::size_t pixel) const {
    const double n = count(pixel);  // >= 2, as the caller ensures
    if (kind_.two_halves) {
        const Pixel &a = pixels_[pixel], &b = pixels_[size_ + pixel];
        const double n_a = a.count, n_b = b.count;
        const double both = is_mean_of_halves(pixel) ? 0.25 : n_a * n_b / sqr(n);
        const double first = double{luminance(value(a))}, second = double{luminance(value(b))};
        return {first, second, both * sqr(first - second)};
    }
    const HalfBuffers& half_buffers = half_buffers_[pixel];
    // The larger of the two is at least n/2, and it is less than n if it is chosen.
    const double last = std::bit_floor(count(pixel)), before = last / 2;
    const bool by_last = last * (n - last) > before * (n - before);
    const double first = by_last ? last : before;
    Halves halves{double{by_last ? half_buffers.last : half_buffers.last_but_one}, 0, 0};
    halves.second = (n * shown(pixel) - first * halves.first) / (n - first);
    halves.variance = sqr(halves.first - halves.second) * first * (n - first) / sqr(n);
    return halves;
}

double Film::around(std::span<const double> shown, int x, int y) const {
    double sum = 0, most = -std::numeric_limits<double>::infinity();
    int pixels = 0;
    for (int v = std::max(0, y - 1); v < std::min(height_, y + 2); ++v) {
        for (int u = std::max(0, x - 1); u < std::min(width_, x + 2); ++u, ++pixels) {
            const double value = shown[place(u, v)];
            sum += value;
            most = std::max(most, value);
        }
    }
    return pixels > 1 ? (sum - most) / (pixels - 1) : sum;
}

std::optional<Film::Brightness> Film::brightness(const Workers& workers) const {
    struct Row {
        std::uint64_t samples = 0, pixels = 0;  // pixels that have any; none of the others' was finite
    };
    std::vector<Row> rows(static_cast<std::size_t>(height_));
    std::atomic<bool> has_single{false};
    for_each_row(workers, [&](int y) {
        Row& row = rows[static_cast<std::size_t>(y)];
        for (std::size_t i = place(0, y); i < place(0, y + 1) && !has_single; ++i) {
            row.samples += count(i);
            if (count(i) > 0) ++row.pixels;
            if (count(i) == 1) has_single = true;
        }
    });
    if (has_single) return std::nullopt;
    Row all;
    for (const Row& row : rows) {
        all.samples += row.samples;
        all.pixels += row.pixels;
    }
    const double least = kind_.by_pass ? 2 : kLeastForError;
    if (all.pixels == 0 || static_cast<double>(all.samples) < least * static_cast<double>(all.pixels))
        return std::nullopt;
    constexpr double kNone = -1;  // the level of pixels without a sample
    std::vector<double> levels(size_, kNone);
    for_each_row(workers, [&](int y) {
        for (std::size_t i = place(0, y); i < place(0, y + 1); ++i)
            if (count(i) > 0) levels[i] = std::fabs(shown(i));
    });
    std::erase(levels, kNone);
    const double brightest = limit_of_most(levels);
    double sum = 0, known = 0;
    for (const double level : levels) {
        if (level <= brightest) sum += level, ++known;
    }
    return Brightness{sum / known, levels.size()};  // known > 0, as most pixels are no outliers
}

// Computes a row's squared errors over squared luminances, and returns the sum of its products of blurs.
double Film::errors_of_row(int y, std::span<const double> shown, double mean, std::span<double> by_halves,
                           std::span<double> by_samples) const {
    double blur = 0;
    for (int x = 0; x < width_; ++x) {
        const std::size_t i = place(x, y);
        if (count(i) == 0) continue;
        const double own = luminance_variance(variance(i));
        // Where nothing varies, the divisor may be 0.
        if (own <= 0) continue;
        const Halves halves = this->halves(i);
        const double level = std::max(around(shown, x, y), std::min(halves.first, halves.second));
        const double scale = error_scale2(level, mean);
        const double n_a = pixels_[i].count, n_b = kind_.tells_blur ? pixels_[size_ + i].count : 0;
        if (n_a > 0 && n_b > 0) blur += blur_[i] / n_a * (blur_[size_ + i] / n_b) / scale;
        by_halves[i] = halves.variance / scale;
        by_samples[i] = own / scale;
    }
    return blur;
}

Film::ErrorEstimate Film::error(const Workers& workers) const {
    const auto known = brightness(workers);
    if (!known) return {INFINITY, 0, false, {}};
    ZeroedVector<double> shown(size_), by_halves(size_), by_samples(size_);
    for_each_row(workers, [&](int y) {
        for (std::size_t i = place(0, y); i < place(0, y + 1); ++i) shown[i] = this->shown(i);
    });
    std::vector<double> blurs(static_cast<std::size_t>(height_));
    for_each_row(workers, [&](int y) {
        blurs[static_cast<std::size_t>(y)] = errors_of_row(y, shown, known->mean, by_halves, by_samples);
    });
    const double blur = std::accumulate(blurs.begin(), blurs.end(), 0.0);
    ErrorEstimate estimate;
    const double limit = limit_of_most({by_samples.begin(), by_samples.end()});
    double halves_sum = 0, halves_fourth = 0, samples_sum = 0, samples_fourth = 0;
    for (std::size_t i = 0; i < size_; ++i) {
        if (by_samples[i] > limit) {
            const auto width = static_cast<std::size_t>(width_);
            estimate.apart.emplace_back(static_cast<int>(i % width), static_cast<int>(i / width));
            continue;
        }
        halves_sum += by_halves[i];
        samples_sum += by_samples[i];
        halves_fourth += sqr(by_halves[i]);
        samples_fourth += sqr(by_samples[i]);
    }
    if (samples_sum <= 0) return estimate;  // known to be 0
    // The variance of a squared difference is twice the square of its mean, a third of which is the mean of
    // its fourth power. Where few pixels dominate, their differences may be small by chance; the second term
    // is the variance of one of so many.
    const double margin = std::sqrt(2.0 / 3 * halves_fourth) + samples_fourth / samples_sum;
    const auto counted = static_cast<double>(known->pixels - estimate.apart.size());
    estimate.relative = std::sqrt(std::min(samples_sum, halves_sum + margin) / counted);
    estimate.is_known = std::sqrt(2.0 / 3 * halves_fourth) <= kMostUncertainty * halves_sum;
    estimate.blur = std::sqrt(kBlurOfDifference * std::max(blur, 0.0) / static_cast<double>(known->pixels));
    return estimate;
}

std::size_t Film::bytes_of_sums() const {
    return std::as_bytes(std::span(pixels_)).size() + std::as_bytes(std::span(passes_)).size() +
           std::as_bytes(std::span(half_buffers_)).size() + std::as_bytes(std::span(blur_)).size();
}

std::vector<std::byte> Film::sums() const {
    std::vector<std::byte> sums;
    sums.reserve(bytes_of_sums());
    for (const auto bytes : {std::as_bytes(std::span(pixels_)), std::as_bytes(std::span(passes_)),
                             std::as_bytes(std::span(half_buffers_)), std::as_bytes(std::span(blur_))})
        sums.insert(sums.end(), bytes.begin(), bytes.end());
    return sums;
}

void Film::restore(std::span<const std::byte> sums) {
    assert(sums.size() == bytes_of_sums());
    for (const auto to :
         {std::as_writable_bytes(std::span(pixels_)), std::as_writable_bytes(std::span(passes_)),
          std::as_writable_bytes(std::span(half_buffers_)), std::as_writable_bytes(std::span(blur_))}) {
        std::copy_n(sums.begin(), to.size(), to.begin());
        sums = sums.subspan(to.size());
    }
}

FilterSampler::FilterSampler(const FilterSettings& settings) : settings_(settings) {
    if (settings.kind == FilterSettings::Kind::box) return;
    x_ = axis(settings.radius.x);
    y_ = axis(settings.radius.y);
}

// Divides the filter into steps of a thousandth of its width, too fine to be visible.
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
    // The bound is far from 0, so that the quotient below stays moderate.
    if (!(sum > 0.05 * result.steps.total())) {
        throw InputError("the integral of this filter is not positive, as its negative lobes are too large");
    }
    result.weight = static_cast<float>(result.steps.total() / sum);
    return result;
}

float FilterSampler::draw(const Axis& axis, float u, float radius, float& weight) {
    const Cdf::Draw step = axis.steps.draw(u);
    weight *= axis.negative[step.item] ? -axis.weight : axis.weight;
    return radius * (2 * (static_cast<float>(step.item) + step.remainder) / kSteps - 1);
}

float FilterSampler::value(const Axis& axis, float offset, float radius) {
    if (!(std::fabs(offset) < radius)) return 0;
    if (axis.negative.empty()) return 1 / (2 * radius);  // the box; radius > |offset|
    const auto at = static_cast<std::size_t>((offset / radius + 1) / 2 * kSteps);
    const std::size_t step = std::min(at, kSteps - 1);
    const double density = axis.steps.probability(step) * kSteps / (2 * double{radius});
    return static_cast<float>(axis.negative[step] ? -density : density) * axis.weight;
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
