// Where samples become pixels. A pixel owns its sums: one thread at a time works on it, in a fixed order.
#pragma once

#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/image.h"
#include "engine/base/vec.h"
#include "engine/render/job.h"

namespace lucerna {

class Film {
  public:
    // `weight`: the magnitude of every sample's weight (FilterSampler::weight).
    Film(int width, int height, float weight = 1)
        : width_(width),
          height_(height),
          weight2_(sqr(weight)),
          pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

    int width() const { return width_; }
    int height() const { return height_; }

    // Finite radiance, W/(m² sr), of a sample with the weight that FilterSampler gave it.
    void add(int x, int y, const Rgb& radiance, float weight = 1);

    // Channels R G B (the pixel times `scale`) and variance.R variance.G variance.B: the variance of that
    // value. Pixels without a sample are black; with one sample the variance is 0 and says nothing.
    //
    // A pixel is E[wL], and E[w] = 1. It is estimated as mean(L) + cov(w, L): as unbiased as mean(wL), and
    // exact where L does not vary, however the signs of the weights fall.
    Image develop(float scale) const;

  private:
    struct Pixel {
        V3f mean{0, 0, 0}, m2{0, 0, 0};  // of the radiance: Welford's sums
        V3f together{0, 0, 0};           // of radiance and weight
        float weight = 0;                // mean
        std::uint32_t count = 0;
    };

    int width_, height_;
    float weight2_ = 1;  // square of every sample's weight
    std::vector<Pixel> pixels_;
};

// Offsets from a pixel's centre, distributed as the reconstruction filter's absolute value: so every sample
// weighs the same, but for its sign, and belongs to one pixel (Ernst, Stamminger, Greiner, "Filter Importance
// Sampling", 2006).
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

  private:
    // One axis, over equal steps of [-radius, radius]; empty for the box.
    struct Axis {
        Cdf steps;                   // of the absolute value
        std::vector<bool> negative;  // steps below 0
        float weight = 1;            // ∫|f| / ∫f
    };
    Axis axis(float radius) const;
    static float draw(const Axis& axis, float u, float radius, float& weight);

    FilterSettings settings_;
    Axis x_, y_;
};

}  // namespace lucerna
