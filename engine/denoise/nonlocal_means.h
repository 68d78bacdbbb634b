// Computes non-local means over both halves of an image [Buades et al. 2005; Rousselle et al. 2012, section
// 4], with features in addition to light [Rousselle et al. 2013].
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"

namespace lucerna {

// Holds one number per pixel, row by row, with a rim of kRim pixels around the image.
class Plane {
  public:
    // These are half sides of the square of pixels that contribute to a pixel, and of the compared patches.
    static constexpr int kWindow = 8, kPatch = 3;
    static constexpr int kRim = kWindow + kPatch;

    // Returns how many rows (or columns) of `pixels` pixels a thread gets at a time: for fewer than about ten
    // thousand pixels, waking a thread takes longer than the work.
    static std::int64_t rows_at_a_time(int pixels) { return std::max(8, 16384 / std::max(1, pixels)); }

    Plane() = default;
    Plane(int width, int height)
        : width_(width),
          height_(height),
          stride_(width + 2 * kRim),
          data_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height + 2 * kRim)) {}

    // Fills every pixel with a function of its place, and the rim with the values at the nearest edge.
    template <typename Value>
    void fill(const Workers& workers, Value&& value) {
        parallel_each(workers, static_cast<std::size_t>(height_), rows_at_a_time(width_),
                      [&](std::size_t row_number) {
                          const auto y = static_cast<int>(row_number);
                          float* const to = row(y);
                          for (int x = 0; x < width_; ++x) to[x] = value(x, y);
                          std::fill_n(to - kRim, kRim, to[0]);
                          std::fill_n(to + width_, kRim, to[width_ - 1]);
                      });
        const auto copy_row = [this](int from, int to) {
            std::copy_n(row(from) - kRim, stride_, row(to) - kRim);
        };
        for (int y = 1; y <= kRim; ++y) {
            copy_row(0, -y);
            copy_row(height_ - 1, height_ - 1 + y);
        }
    }

    // Returns the address of pixel (0, y). The rim before and after a row belongs to the plane.
    float* row(int y) { return &data_[start(y)]; }
    const float* row(int y) const { return &data_[start(y)]; }

  private:
    std::size_t start(int y) const {
        return static_cast<std::size_t>(y + kRim) * static_cast<std::size_t>(stride_) + kRim;
    }
    int width_ = 0, height_ = 0, stride_ = 0;
    std::vector<float> data_;
};
using ColourPlanes = std::array<Plane, 3>;

// Holds the planes that both halves share.
struct FeaturePlanes {
    ColourPlanes albedo, normal, geometric_normal, position;
    Plane emitter;
    // Holds the inverse distance between the surface points of a pixel and its nearest neighbour; 0 without
    // one.
    Plane inverse_footprint;
    // `inside` is 1 in the image and 0 in the rim.
    Plane inside;
};
struct HalfPlanes {
    ColourPlanes value, variance;
    Plane trust;  // weight of a pixel for others, in [0, 1]
};

// Determines how a pixel weights those around it.
enum class Candidate : std::uint8_t {
    trusting,  // by the likeness of their patches
    wary,      // by that likeness times their trust
    loose      // as `wary`, but patches may be less alike
};
inline constexpr std::size_t kCandidates = 3;
// Holds the filtered planes of one half, one for each candidate.
using Filtered = std::array<ColourPlanes, kCandidates>;

std::array<Filtered, 2> nonlocal_means(int width, int height, const FeaturePlanes& features,
                                       const std::array<HalfPlanes, 2>& halves, const Workers& workers);

}  // namespace lucerna
