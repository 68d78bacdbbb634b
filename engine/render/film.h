// Accumulates samples in pixels. A pixel owns its sums: one thread at a time works on it, in a fixed order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/huge_pages.h"
#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "engine/render/job.h"

namespace lucerna {

class Film {
  public:
    struct Kind {
        float weight = 1;         // the magnitude of every sample's weight (FilterSampler::weight)
        bool by_pass = false;     // samples are added by add_pass(), not by add()
        bool two_halves = false;  // samples belong to two independent halves
        // The number of samples of a half depends on what the other saw (allocation.h): the image is the mean
        // of both halves with equal weights, and not of all samples.
        bool allocated = false;
        bool tells_blur = false;  // samples include the blur of density estimates
    };
    Film(int width, int height, const Kind& kind)
        : width_(width),
          height_(height),
          size_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
          kind_(kind),
          pixels_(kind.two_halves ? 2 * size_ : size_),
          passes_(kind.by_pass ? pixels_.size() : 0),
          half_buffers_(kind.two_halves ? 0 : size_),
          blur_(kind.tells_blur ? pixels_.size() : 0) {}
    Film(int width, int height) : Film(width, height, Kind()) {}

    int width() const { return width_; }
    int height() const { return height_; }
    bool has_two_halves() const { return kind_.two_halves; }

    // Adds a sample of finite radiance, W/(m² sr), with the weight that FilterSampler gave it. `half` is 0 or
    // 1 if the film has two halves, else 0. `blur` is the luminance of SampleAccount::blur.
    void add(int x, int y, const Rgb& radiance, float weight = 1, int half = 0, float blur = 0);

    struct Sample {
        Rgb radiance;
        float weight;
        float blur = 0;
    };
    // Adds the samples of one pass through a pixel. They depend on each other, because they use the same
    // photons; samples of different passes do not, so that the variance is taken between passes.
    void add_pass(int x, int y, std::span<const Sample> samples, int half = 0);

    // The luminance of a pixel in one half, and the variance of the luminance of one of its samples.
    struct OfHalf {
        double luminance, variance;
    };
    OfHalf of_half(int x, int y, int half) const;

    bool has_sample(int x, int y) const { return count(place(x, y)) > 0; }
    // Returns the step in which a pixel gets its first samples: 0 for one pixel in 16, 1 for one in four, and
    // 2 for all others.
    static int step_of(const V2i& at) {
        return ((at.x | at.y) & 3) == 0 ? 0 : ((at.x | at.y) & 1) == 0 ? 1 : 2;
    }
    // Returns the spacing of the finest lattice of pixels, 1, 2 or 4 pixels, that all have a sample; 4 if
    // there is none.
    int spacing(const Workers& workers = Workers{1}) const;

    // Makes channels R G B (the pixel times `scale`) and variance.R variance.G variance.B, the variance of
    // that value. Pixels without a sample are black (FeatureFilter::fill).
    // With one sample the variance is 0 and has no meaning. Values beyond float32 (from radiances above about
    // 1e19) are stored as the largest float32.
    //
    // A pixel is E[wL], with E[w] = 1. It is estimated as mean(L) + cov(w, L): as unbiased as mean(wL), and
    // exact where L does not vary, whatever the signs of the weights.
    // The film holds light (working_space.h); the image has the components of that space.
    Image develop(float scale, const WorkingSpace& colours = {}, const Workers& workers = Workers{1}) const;
    // Develops one half of the samples (half_channels() of engine/denoise/denoise.h) of a film with two
    // halves.
    Image develop_half(int half, float scale, const WorkingSpace& colours = {},
                       const Workers& workers = Workers{1}) const;

    // Estimates the remaining noise as a relative error: the root of the mean, over all pixels, of the
    // squared error of luminance over the squared luminance (plus the square of a tenth of the image's mean,
    // so that black pixels do not dominate). It excludes bias. It is infinite until the pixels have
    // kLeastForError samples on average, or two passes, and 0 if nothing varies.
    //
    // Errors are differences between two halves of the samples: a pixel's samples are stratified, so that
    // their mean is more accurate than their own variance suggests. That variance bounds the error where
    // halves are too few. Luminances are those on which neighbours and both halves agree: relative to the one
    // bright sample that causes it, the error of a firefly would be small.
    //
    // A few pixels must not decide the error of the image alone: pixels that see a lamp smaller than
    // themselves vary by far more than all others. At most one pixel in a thousand is left out of the error
    // and the mean, if these vary more than ten times as much as any other and more than all others together.
    static constexpr int kLeastForError = 4;  // two or three miss too much rare, bright light
    // The squared blur of an estimate over the square of D, for Epanechnikov's kernel across an edge, where
    // the blur grows as the radius. Where light is smooth, blur grows as the area of the disc, and 1.14 would
    // do.
    static constexpr double kBlurOfDifference = 1.9;
    static constexpr double kMostUncertainty = 0.18;
    struct ErrorEstimate {
        double relative = 0;
        // Relative blur of density estimates; 0 if the samples do not measure it. D, the difference of an
        // estimate from one on a disc a quarter as wide, has the mean of the blur, except for the blur of the
        // smaller disc itself, and much noise. D_A and D_B of two halves are independent, so that the mean of
        // their product is the square of D's mean without a noise term.
        double blur = 0;
        // Whether `relative` is reliable: the standard error of the mean of the squares, over the pixels, is
        // at most kMostUncertainty of it. It is larger where fireflies make most of an error.
        bool is_known = true;
        std::vector<V2i> apart;  // the pixels left out, in reading order
    };
    ErrorEstimate error(const Workers& workers = Workers{1}) const;
    double relative_error(const Workers& workers = Workers{1}) const { return error(workers).relative; }

    // Returns the state of the film as bytes, for continuation by this program on a machine of the same byte
    // order.
    std::vector<std::byte> sums() const;
    std::size_t bytes_of_sums() const;
    static constexpr std::size_t bytes_per_pixel(const Kind& kind) {
        const std::size_t half =
            sizeof(Pixel) + (kind.by_pass ? sizeof(Passes) : 0) + (kind.tells_blur ? sizeof(float) : 0);
        return kind.two_halves ? 2 * half : half + sizeof(HalfBuffers);
    }
    // Restores sums() of a film of the same size and kind, of bytes_of_sums() bytes.
    void restore(std::span<const std::byte> sums);
    // Packs or unpacks the sums of pixels [begin, end), for a film of the same size and kind on another rank.
    template <typename Archive>
    void fields_of(const V2i& begin, const V2i& end, Archive& archive) {
        const auto row_of = [&](auto& values, std::size_t first) {
            auto row = std::span(values).subspan(first, static_cast<std::size_t>(end.x - begin.x));
            archive(row);
        };
        for (int y = begin.y; y < end.y; ++y) {
            for (std::size_t first = place(begin.x, y); first < pixels_.size(); first += size_) {
                row_of(pixels_, first);
                if (kind_.by_pass) row_of(passes_, first);
                if (kind_.tells_blur) row_of(blur_, first);
            }
            if (!half_buffers_.empty()) row_of(half_buffers_, place(begin.x, y));
        }
    }

  private:
    struct Pixel {
        V3f mean{0, 0, 0};  // of the radiance, by Welford's method
        // The root of M2, the sum of squared deviations. M2 itself would leave the range of float32 for
        // radiances of 1e20 or 1e-20.
        V3f root_m2{0, 0, 0};
        V3f covariance_sum{0, 0, 0};  // Welford's sum for the covariance of radiance and weight
        float weight = 0;             // mean
        std::uint32_t count = 0;
    };
    // Welford's sums of the values of passes.
    struct Passes {
        V3f mean{0, 0, 0}, root_m2{0, 0, 0};
        std::uint32_t count = 0;
    };
    // For films without two halves: the pixel's luminance after the last two powers of two of samples (or
    // passes), at which stratification is complete.
    struct HalfBuffers {
        float last_but_one = 0, last = 0;
    };
    // The types have no padding.
    static_assert(sizeof(Pixel) == 11 * 4 && sizeof(Passes) == 7 * 4 && sizeof(HalfBuffers) == 2 * 4);

    // A pixel's samples in two parts: its halves, or parts as equal as the half buffers allow.
    struct Halves {
        double first, second;  // luminance
        double variance;       // of the pixel, from the squared difference of the parts as if independent
    };

    bool is_mean_of_halves(std::size_t pixel) const {
        return kind_.allocated && pixels_[pixel].count > 0 && pixels_[size_ + pixel].count > 0;
    }
    V3f value_at(std::size_t pixel) const {
        if (!is_mean_of_halves(pixel)) return value(whole(pixel));
        return 0.5F * (value(pixels_[pixel]) + value(pixels_[size_ + pixel]));
    }
    // Returns the sums of both halves together, or of the only one.
    Pixel whole(std::size_t pixel) const {
        return kind_.two_halves ? merged(pixels_[pixel], pixels_[size_ + pixel]) : pixels_[pixel];
    }
    Passes whole_passes(std::size_t pixel) const {
        return kind_.two_halves ? merged(passes_[pixel], passes_[size_ + pixel]) : passes_[pixel];
    }
    static Pixel merged(const Pixel& a, const Pixel& b);
    static Passes merged(const Passes& a, const Passes& b);

    std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    std::uint32_t count(std::size_t pixel) const {  // number of samples or passes
        const auto of = [pixel, this](const auto& sums) {
            return sums[pixel].count + (kind_.two_halves ? sums[size_ + pixel].count : 0);
        };
        return kind_.by_pass ? of(passes_) : of(pixels_);
    }
    void add_sample(Pixel& pixel, const Rgb& radiance, float weight);
    void update_half_buffers(std::size_t pixel);
    // Stores a value and its variance as in an image, with the light multiplied by `scales`.
    static void store(const V3f& value, const V3d& variance, const V3f& scales, float* to);
    static V3f value(const Pixel& pixel);
    double shown(std::size_t pixel) const;  // luminance of its value
    // Returns the variance of the value with these sums of samples or passes; 0 while there is only one.
    V3d variance(const Pixel& pixel) const;
    static V3d variance(const Passes& passes);
    V3d variance(std::size_t pixel) const {
        if (kind_.by_pass) return variance(whole_passes(pixel));
        const double n_a = pixels_[pixel].count, n_b = kind_.two_halves ? pixels_[size_ + pixel].count : 0;
        // A half of one sample has no variance of its own. Then the variance of a sample is estimated from
        // all samples together.
        if (!is_mean_of_halves(pixel) || std::min(n_a, n_b) < 2) {
            const double of_mean = is_mean_of_halves(pixel) ? sqr(n_a + n_b) / (4 * n_a * n_b) : 1;
            return of_mean * variance(whole(pixel));
        }
        return 0.25 * (variance(pixels_[pixel]) + variance(pixels_[size_ + pixel]));
    }
    Halves halves(std::size_t pixel) const;
    // The mean luminance of pixels without outliers, and the number of pixels with samples. None if there are
    // too few samples for an error.
    struct Brightness {
        double mean;
        std::size_t pixels;
    };
    std::optional<Brightness> brightness(const Workers& workers) const;
    double errors_of_row(int y, std::span<const double> shown, double mean, std::span<double> by_halves,
                         std::span<double> by_samples) const;
    // Returns the mean of the pixel and its neighbours without the brightest of them.
    double around(std::span<const double> shown, int x, int y) const;
    // Calls body(y) for all rows.
    template <typename Body>
    void for_each_row(const Workers& workers, Body&& body) const {
        constexpr std::int64_t kRows = 8;  // that a thread gets at a time
        parallel_each(workers.alone(), static_cast<std::size_t>(height_), kRows,
                      [&body](std::size_t y) { body(static_cast<int>(y)); });
    }

    int width_, height_;
    std::size_t size_;  // pixels
    Kind kind_;
    ZeroedVector<Pixel> pixels_;              // with two halves: the first half, then the second
    ZeroedVector<Passes> passes_;             // empty, or as many as pixels_
    ZeroedVector<HalfBuffers> half_buffers_;  // empty, or one for each pixel
    ZeroedVector<float> blur_;                // sums over weighted samples; empty, or as many as pixels_
};

// Samples offsets from a pixel's centre with the density of the reconstruction filter's absolute value, so
// that every sample has the same weight up to its sign and belongs to one pixel [Ernst 2006].
class FilterSampler {
  public:
    // Throws InputError for a filter whose integral is not positive.
    explicit FilterSampler(const FilterSettings& settings);

    struct Sample {
        V2f offset;    // pixels
        float weight;  // the filter over its density: 1, or +-weight() for a filter with negative lobes
    };
    Sample sample(const V2f& u) const;
    float weight() const { return x_.weight * y_.weight; }
    // Returns the filter over its integral, per square pixel, which is the function that sample() integrates.
    float value(const V2f& offset) const {
        return value(x_, offset.x, radius().x) * value(y_, offset.y, radius().y);
    }
    const V2f& radius() const { return settings_.radius; }

  private:
    // The filter along one axis, over equal steps of [-radius, radius]; empty for the box.
    struct Axis {
        Cdf steps;                   // of the absolute value
        std::vector<bool> negative;  // steps below 0
        float weight = 1;            // ∫|f| / ∫f
    };
    Axis axis(float radius) const;
    static float draw(const Axis& axis, float u, float radius, float& weight);
    static float value(const Axis& axis, float offset, float radius);

    FilterSettings settings_;
    Axis x_, y_;
};

}  // namespace lucerna
