// Planes: one number per pixel, with a rim.
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
    // Width of the rim: as far as windows and patches reach.
    static constexpr int kRim = 8;

    // Returns how many rows (or columns) of `pixels` pixels a thread gets at a time: for fewer than about ten
    // thousand pixels, waking a thread takes longer than the work.
    static std::int64_t rows_at_a_time(int pixels) { return std::max(8, 16384 / std::max(1, pixels)); }

    Plane() = default;
    Plane(int width, int height)
        : width_(width),
          height_(height),
          stride_(width + 2 * kRim),
          data_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height + 2 * kRim)) {}

    int width() const { return width_; }
    int height() const { return height_; }

    // Fills every pixel with a function of its place, and the rim with the values at the nearest edge.
    template <typename Value>
    void fill(const Workers& workers, Value&& value) {
        parallel_each(workers, static_cast<std::size_t>(height_), rows_at_a_time(width_),
                      [&](std::size_t row_number) {
                          const auto y = static_cast<int>(row_number);
                          float* const to = row(y);
                          for (int x = 0; x < width_; ++x) to[x] = value(x, y);
                      });
        extend();
    }

    // Fills the rim with the values at the nearest edge.
    void extend() {
        for (int y = 0; y < height_; ++y) {
            float* const of_row = row(y);
            std::fill_n(of_row - kRim, kRim, of_row[0]);
            std::fill_n(of_row + width_, kRim, of_row[width_ - 1]);
        }
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

}  // namespace lucerna
