// Planes: one number per pixel, with a rim.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"

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

    // Fill the rim with the values at the nearest edge: that beside a row, and then those above and below.
    void extend_row(int y) {
        float* const of_row = row(y);
        std::fill_n(of_row - kRim, kRim, of_row[0]);
        std::fill_n(of_row + width_, kRim, of_row[width_ - 1]);
    }
    void extend_ends() {
        const auto copy_row = [this](int from, int to) {
            std::copy_n(row(from) - kRim, stride_, row(to) - kRim);
        };
        for (int y = 1; y <= kRim; ++y) {
            copy_row(0, -y);
            copy_row(height_ - 1, height_ - 1 + y);
        }
    }

    // Fills every pixel with a function of its place, and the rim with the values at the nearest edge.
    template <typename Value>
    void fill(const Workers& workers, Value&& value) {
        parallel_each(workers, static_cast<std::size_t>(height_), rows_at_a_time(width_),
                      [&](std::size_t row_number) {
                          const auto y = static_cast<int>(row_number);
                          float* const to = row(y);
                          for (int x = 0; x < width_; ++x) to[x] = value(x, y);
                          extend_row(y);
                      });
        extend_ends();
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

// Returns the values at a pixel.
inline V3f at(const ColourPlanes& planes, const V2i& p) {
    return {planes[0].row(p.y)[p.x], planes[1].row(p.y)[p.x], planes[2].row(p.y)[p.x]};
}

inline V2i size_of(const Plane& plane) {
    return {plane.width(), plane.height()};
}

template <typename Body>
void for_each_row(const Workers& workers, const V2i& size, Body&& body) {
    parallel_each(workers, static_cast<std::size_t>(size.y), Plane::rows_at_a_time(size.x),
                  [&body](std::size_t y) { body(static_cast<int>(y)); });
}

// Calls body(y) for every row, which fills that row of planes of one size, and fills their rims with the
// values at the nearest edge. Planes that are filled together are read together, and threads wait for each
// other once.
template <typename Body>
void fill_rows(const Workers& workers, const std::vector<Plane*>& planes, Body&& body) {
    for_each_row(workers, size_of(*planes.front()), [&](int y) {
        body(y);
        for (Plane* const plane : planes) plane->extend_row(y);
    });
    for (Plane* const plane : planes) plane->extend_ends();
}

// Makes planes of one size, whose pixels and rims are 0.
inline void make_planes(const V2i& size, const std::vector<Plane*>& planes) {
    for (Plane* const plane : planes) *plane = Plane(size.x, size.y);
}

// Returns how many of the pixels within `reach` of pixel i lie in [0, end).
inline int pixels_along(int i, int end, int reach) {
    return std::min(end - 1, i + reach) - std::max(0, i - reach) + 1;
}

// Returns sums over squares of half side `reach` of each plane, and calls finish(y, sums) for each row of
// them. The rims of `from` must be 0, and so are those of the sums.
template <std::size_t N, typename Finish>
std::array<Plane, N> sums(const std::array<const Plane*, N>& from, int reach, const Workers& workers,
                          Finish&& finish) {
    const V2i size = size_of(*from[0]);
    std::array<Plane, N> across, result;
    for (std::size_t i = 0; i < N; ++i) make_planes(size, {&across[i], &result[i]});
    for_each_row(workers, size, [&](int y) {
        for (std::size_t i = 0; i < N; ++i) {
            const float* const in = from[i]->row(y);
            float* const out = across[i].row(y);
            for (int offset = -reach; offset <= reach; ++offset) {
                for (int x = 0; x < size.x; ++x) out[x] += in[x + offset];
            }
        }
    });
    for_each_row(workers, size, [&](int y) {
        for (std::size_t i = 0; i < N; ++i) {
            float* const out = result[i].row(y);
            for (int v = std::max(0, y - reach); v <= std::min(size.y - 1, y + reach); ++v) {
                const float* const in = across[i].row(v);
                for (int x = 0; x < size.x; ++x) out[x] += in[x];
            }
            finish(y, out);
        }
    });
    return result;
}
template <std::size_t N>
std::array<Plane, N> sums(const std::array<const Plane*, N>& from, int reach, const Workers& workers) {
    return sums(from, reach, workers, [](int /*y*/, float* /*sums*/) {});
}

// Returns means over such squares, clipped at the image's rim.
template <std::size_t N>
std::array<Plane, N> smoothed(const std::array<const Plane*, N>& from, int reach, const Workers& workers) {
    const V2i size = size_of(*from[0]);
    std::vector<float> columns(static_cast<std::size_t>(size.x));
    for (int x = 0; x < size.x; ++x)
        columns[static_cast<std::size_t>(x)] = static_cast<float>(pixels_along(x, size.x, reach));
    return sums(from, reach, workers, [&](int y, float* to) {
        const auto rows = static_cast<float>(pixels_along(y, size.y, reach));
        for (std::size_t x = 0; x < columns.size(); ++x) to[x] /= rows * columns[x];
    });
}

// Writes the means about the pixels of a row over squares of 2 kReach + 1 pixels a side, kStep apart, without
// the two largest values: what is far above all others neither counts nor has to cancel.
template <int kReach, int kStep>
void mean_of_most(const Plane& from, int y, std::vector<float>& means) {
    static_assert(kReach * kStep <= Plane::kRim);
    constexpr float kCounted = (2 * kReach + 1) * (2 * kReach + 1) - 2;
    constexpr std::size_t kBlock = 64;
    for (std::size_t begin = 0; begin < means.size(); begin += kBlock) {
        std::array<float, kBlock> sum{}, most{}, next{};  // local arrays alias no plane
        const std::size_t pixels = std::min(kBlock, means.size() - begin);
        for (int v = -kReach; v <= kReach; ++v) {
            for (int u = -kReach; u <= kReach; ++u) {
                const float* const in =
                    from.row(y + kStep * v) + (static_cast<std::ptrdiff_t>(begin) + kStep * u);
                for (std::size_t x = 0; x < pixels; ++x) {
                    const float below = std::min(most[x], in[x]);
                    most[x] = std::max(most[x], in[x]);
                    sum[x] += std::min(next[x], below);
                    next[x] = std::max(next[x], below);
                }
            }
        }
        for (std::size_t x = 0; x < pixels; ++x) means[begin + x] = sum[x] / kCounted;
    }
}

}  // namespace lucerna
