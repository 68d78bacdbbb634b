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
    Film(int width, int height)
        : width_(width),
          height_(height),
          pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

    int width() const { return width_; }
    int height() const { return height_; }

    // Finite radiance, W/(m² sr).
    void add(int x, int y, const Rgb& radiance);

    // Channels R G B (the mean times `scale`) and variance.R variance.G variance.B: the variance of that
    // mean. Pixels without a sample are black; with one sample the variance is 0 and says nothing.
    Image develop(float scale) const;

  private:
    struct Pixel {
        V3f mean{0, 0, 0}, m2{0, 0, 0};  // Welford's sums
        std::uint32_t count = 0;
    };

    int width_, height_;
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
        float weight;  // the filter over its density; 1 unless the filter has negative lobes
    };
    Sample sample(const V2f& u) const;

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
