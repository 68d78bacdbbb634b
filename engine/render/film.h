// Where samples become pixels. A pixel owns its sums: one thread at a time works on it, in a fixed order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/image/image.h"
#include "engine/render/job.h"

namespace lucerna {

class Film {
  public:
    struct Kind {
        float weight = 1;         // the magnitude of every sample's weight (FilterSampler::weight)
        bool by_pass = false;     // samples come by add_pass(), not by add()
        bool two_halves = false;  // they are of two halves that do not depend on each other
        // How many samples a half has depends on what the other saw (allocation.h): the image is the mean of
        // both, each with the same weight, and not of all samples.
        bool allocated = false;
        bool tells_blur = false;  // samples tell what density estimates blur
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

    // Finite radiance, W/(m² sr), of a sample with the weight that FilterSampler gave it. `half`: 0 or 1, of
    // a film of two halves; else 0. `blur`: the luminance of SampleAccount::blur.
    void add(int x, int y, const Rgb& radiance, float weight = 1, int half = 0, float blur = 0);

    struct Sample {
        Rgb radiance;
        float weight;
        float blur = 0;
    };
    // Adds the samples of one pass through a pixel. They depend on each other, because they use the same
    // photons; samples of different passes do not, so that the variance is taken between passes.
    void add_pass(int x, int y, std::span<const Sample> samples, int half = 0);

    // The luminance of a pixel by one half, and the variance of that of one of its samples.
    struct OfHalf {
        double luminance, variance;
    };
    OfHalf of_half(int x, int y, int half) const;

    bool has_sample(int x, int y) const { return count(place(x, y)) > 0; }
    // The first samples come in steps: 0, of one pixel in 16, 1, of one in four, and 2, of all others.
    static int step_of(const V2i& at) {
        return ((at.x | at.y) & 3) == 0 ? 0 : ((at.x | at.y) & 1) == 0 ? 1 : 2;
    }
    std::size_t without_sample() const;  // pixels

    // Channels R G B (the pixel times `scale`) and variance.R variance.G variance.B: the variance of that
    // value. Pixels without a sample show the nearest of an earlier step that has one, and are black where
    // there is none; with one sample the variance is 0 and says nothing. Values beyond float32 (from
    // radiances above some 1e19) are written as its largest number.
    //
    // A pixel is E[wL], and E[w] = 1. It is estimated as mean(L) + cov(w, L): as unbiased as mean(wL), and
    // exact where L does not vary, however the signs of the weights fall.
    // The film holds light (working_space.h); the image has the components of that space.
    Image develop(float scale, const WorkingSpace& colours = {}) const;
    // Develops one half of the samples (half_channels() of engine/denoise/denoise.h) of a film with two
    // halves.
    Image develop_half(int half, float scale, const WorkingSpace& colours = {}) const;

    // The noise that is left, as a share: the root of the mean, over all pixels, of the squares of each
    // pixel's error of luminance over its luminance (plus a tenth of the image's mean, both squared, so that
    // black pixels do not count for more than they show). Bias is no part of it. Infinite until the pixels
    // have kLeastForError samples on average, or two passes; 0 if nothing varies.
    //
    // Errors are the difference between two halves of the samples: a pixel's samples are stratified, so that
    // their mean is better than their own variance tells. That variance bounds it where halves are too few to
    // go by. Luminances are what neighbours and both halves agree on: relative to the one sample that made it
    // bright, the error of a firefly would be none.
    //
    // A few pixels must not decide the error of the image alone: pixels that see a lamp smaller than
    // themselves vary by far more than all others. At most one pixel in a thousand is left out of the error
    // and the mean, if these vary more than ten times as much as any other and more than all others together.
    static constexpr int kLeastForError = 4;  // two or three have met too little of what is rare and bright
    // The square of an estimate's blur over that of D, by Epanechnikov's kernel across an edge, where it
    // grows as the radius. Where light is smooth, blur grows as the disc's area, and 1.14 would do.
    static constexpr double kBlurOfDifference = 1.9;
    static constexpr double kMostUncertainty = 0.18;
    struct ErrorEstimate {
        double relative = 0;
        // Relative blur of density estimates; 0 if the samples do not measure it. D, the difference of an
        // estimate from one on a disc a quarter as wide, has the mean of the blur, except for the blur of the
        // smaller disc itself, and much noise. D_A and D_B of two halves are independent, so that the mean of
        // their product is the square of D's mean without a noise term.
        double blur = 0;
        // Whether `relative` is worth a statement: the standard error of the mean of the squares, over the
        // pixels, is no more than kMostUncertainty of it. It is more where fireflies make most of an error.
        bool is_known = true;
        std::vector<V2i> apart;  // those pixels, rows first
    };
    ErrorEstimate error() const;
    double relative_error() const { return error().relative; }

    // All that is known, as bytes: for going on elsewhere, by this program on a machine of its byte order.
    std::vector<std::byte> sums() const;
    std::size_t bytes_of_sums() const;
    static constexpr std::size_t bytes_per_pixel(const Kind& kind) {
        const std::size_t half =
            sizeof(Pixel) + (kind.by_pass ? sizeof(Passes) : 0) + (kind.tells_blur ? sizeof(float) : 0);
        return kind.two_halves ? 2 * half : half + sizeof(HalfBuffers);
    }
    // Takes up sums() of a film of the same size and kind: as many bytes as bytes_of_sums().
    void restore(std::span<const std::byte> sums);
    // The sums of pixels [begin, end), for a film of the same size and kind on another rank.
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
        V3f mean{0, 0, 0};  // of the radiance: Welford's sums
        // The root of M2, the sum of squared deviations, which float32 cannot hold of 1e20 W nor of 1e-20.
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
    // Where samples are not of two halves, the pixel's half buffers: its luminance after the last powers of
    // two of samples (passes, if it has them): what is stratified is whole there.
    struct HalfBuffers {
        float last_but_one = 0, last = 0;
    };
    // Numbers without gaps between them.
    static_assert(sizeof(Pixel) == 11 * 4 && sizeof(Passes) == 7 * 4 && sizeof(HalfBuffers) == 2 * 4);

    // A pixel's samples in two parts: its halves, or as equal as the half buffers allow.
    struct Halves {
        double first, second;  // luminance
        double variance;       // of the pixel's, were the parts independent: their difference, squared
    };

    bool is_mean_of_halves(std::size_t pixel) const {
        return kind_.allocated && pixels_[pixel].count > 0 && pixels_[size_ + pixel].count > 0;
    }
    V3f value_at(std::size_t pixel) const {
        if (!is_mean_of_halves(pixel)) return value(whole(pixel));
        return 0.5F * (value(pixels_[pixel]) + value(pixels_[size_ + pixel]));
    }
    // A pixel of both halves together, or of the only one; a pixel's passes alike.
    Pixel whole(std::size_t pixel) const {
        return kind_.two_halves ? merged(pixels_[pixel], pixels_[size_ + pixel]) : pixels_[pixel];
    }
    Passes whole_passes(std::size_t pixel) const {
        return kind_.two_halves ? merged(passes_[pixel], passes_[size_ + pixel]) : passes_[pixel];
    }
    static Pixel merged(const Pixel& a, const Pixel& b);
    static Passes merged(const Passes& a, const Passes& b);

    std::size_t shown_at(std::size_t pixel) const;
    std::size_t place(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    }
    std::uint32_t count(std::size_t pixel) const {  // of samples or passes
        const auto of = [pixel, this](const auto& sums) {
            return sums[pixel].count + (kind_.two_halves ? sums[size_ + pixel].count : 0);
        };
        return kind_.by_pass ? of(passes_) : of(pixels_);
    }
    void add_sample(Pixel& pixel, const Rgb& radiance, float weight);
    void update_half_buffers(std::size_t pixel);
    // A value and its variance as an image stores them, the light in units of `scales`.
    static void store(const V3f& value, const V3d& variance, const V3f& scales, float* to);
    static V3f value(const Pixel& pixel);
    double shown(std::size_t pixel) const;  // luminance of its value
    // Returns the variance of the value with these sums of samples or passes; 0 while there is only one.
    V3d variance(const Pixel& pixel) const;
    static V3d variance(const Passes& passes);
    V3d variance(std::size_t pixel) const {
        if (kind_.by_pass) return variance(whole_passes(pixel));
        const double n_a = pixels_[pixel].count, n_b = kind_.two_halves ? pixels_[size_ + pixel].count : 0;
        // A half of one sample has no variance of its own: then all samples together tell that of one.
        if (!is_mean_of_halves(pixel) || std::min(n_a, n_b) < 2) {
            const double of_mean = is_mean_of_halves(pixel) ? sqr(n_a + n_b) / (4 * n_a * n_b) : 1;
            return of_mean * variance(whole(pixel));
        }
        return 0.25 * (variance(pixels_[pixel]) + variance(pixels_[size_ + pixel]));
    }
    Halves halves(std::size_t pixel) const;
    // The mean of what pixels show, but for what few pixels decide alone; and how many have samples. None if
    // there are too few for an error.
    struct Brightness {
        double mean;
        std::size_t pixels;
    };
    std::optional<Brightness> brightness() const;
    // Returns the mean of the pixel and its neighbours without the brightest of them.
    double around(std::span<const double> shown, int x, int y) const;

    int width_, height_;
    std::size_t size_;  // pixels
    Kind kind_;
    std::vector<Pixel> pixels_;              // of two halves: the first's, then the second's
    std::vector<Passes> passes_;             // empty, or as many
    std::vector<HalfBuffers> half_buffers_;  // empty, or one for each pixel
    std::vector<float> blur_;                // empty, or the sum of the weighted samples', as many as pixels_
};

// Offsets from a pixel's centre, distributed as the reconstruction filter's absolute value: so every sample
// weighs the same, but for its sign, and belongs to one pixel [Ernst 2006].
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
    // The filter over its integral, per square pixel: what sample() integrates.
    float value(const V2f& offset) const {
        return value(x_, offset.x, radius().x) * value(y_, offset.y, radius().y);
    }
    const V2f& radius() const { return settings_.radius; }

  private:
    // One axis, over equal steps of [-radius, radius]; empty for the box.
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
