// Collects the k smallest keys, with ties broken by index, so that the result does not depend on the order of
// visits.
//
// Candidates are collected in a buffer, which is cut back to k whenever it is full. A search that takes whole
// blocks of candidates thus moves each once or twice, where a heap would sift each through its levels.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace lucerna {

struct Neighbour {
    std::uint32_t index;
    float key;  // squared distance by any measure; not negative

    // Orders by key, then by index, in one number: the bits of floats that are not negative are ordered.
    std::uint64_t rank() const { return std::uint64_t{std::bit_cast<std::uint32_t>(key)} << 32 | index; }
    bool operator<(const Neighbour& other) const { return rank() < other.rank(); }
};

// Returns the largest float below x > 0. A search takes keys up to and including its bound.
inline float just_below(float x) {
    return std::isinf(x) ? std::numeric_limits<float>::max() : std::nextafter(x, 0.0F);
}

// Sorts `items` into `to`, which has as many places. Squared distances around a point in a plane are evenly
// distributed, as areas are, so binning them first leaves little to compare. Other keys are sorted, too, but
// more slowly.
inline std::span<const Neighbour> sort_far(std::span<const Neighbour> items, Neighbour* to) {
    constexpr std::size_t kMostBins = 256;
    constexpr std::uint32_t kCrowd = 16;
    float largest = 0;
    for (const Neighbour& n : items) largest = std::max(largest, n.key);
    const std::size_t bins = std::min(kMostBins, std::bit_ceil(items.size()));
    // The scale is finite, so that a key of 0 stays 0. A scaled key exceeds `bins` only by rounding.
    const float scale = std::min(static_cast<float>(bins) / largest, std::numeric_limits<float>::max());
    const auto bin_of = [&](const Neighbour& n) {
        return std::min(static_cast<std::size_t>(static_cast<std::int32_t>(n.key * scale)), bins - 1);
    };
    std::array<std::uint32_t, kMostBins> ends{};
    for (const Neighbour& n : items) ++ends[bin_of(n)];
    std::uint32_t sum = 0;
    bool crowded = false;
    for (std::uint32_t& end : std::span(ends).first(bins)) {
        crowded = crowded || end > kCrowd;
        sum += std::exchange(end, sum);  // holds the begin of the bin until it is filled
    }
    for (const Neighbour& n : items) to[ends[bin_of(n)]++] = n;
    if (crowded) {
        std::sort(to, to + items.size());
        return {to, items.size()};
    }
    for (std::size_t i = 1; i < items.size(); ++i) {
        const Neighbour n = to[i];
        std::size_t at = i;
        for (; at > 0 && n < to[at - 1]; --at) to[at] = to[at - 1];
        to[at] = n;
    }
    return {to, items.size()};
}

class Nearest {
  public:
    // Up to kInline candidates are stored on the stack of the query; only more of them allocate. Requires k
    // >= 1, and keys below `most`, which may be infinite.
    Nearest(std::size_t k, float most) : k_(k), limit_(k + kSlack), bound_(just_below(most)) {
        assert(k > 0 && most > 0);
    }
    Nearest(const Nearest&) = delete;
    Nearest& operator=(const Nearest&) = delete;

    // Returns the largest key that may still be among the k nearest. It is finite and never grows.
    float bound() const { return bound_; }

    // Takes the keys of the points `first`, `first` + 1, ... and returns the bound. NaN and infinite keys are
    // skipped.
    template <std::size_t N>
    float take(const std::array<float, N>& keys, std::uint32_t first) {
        reserve(N);
        Neighbour* const to = data_;
        std::size_t size = size_;
        const float bound = bound_;
        // Each candidate is written and kept only if it counts, which avoids a mispredicted branch.
        for (std::size_t i = 0; i < N; ++i) {
            to[size] = {first + static_cast<std::uint32_t>(i), keys[i]};
            size += static_cast<std::size_t>(keys[i] <= bound);
        }
        size_ = size;
        if (size_ >= limit_) cut();
        return bound_;
    }
    float take(float key, std::uint32_t index) { return take(std::array{key}, index); }

    // Returns the nearest, at most k of them, in ascending order. No more keys may be taken afterwards.
    std::span<const Neighbour> sorted() {
        if (size_ > k_) cut();
        if (size_ < kSpread) {
            std::sort(data_, data_ + size_);
            return {data_, size_};
        }
        reserve(size_);
        return sort_far({data_, size_}, data_ + size_);
    }

  private:
    static constexpr std::size_t kInline = 1088;  // enough for the 512 nearest
    static constexpr std::size_t kSlack = 16;
    static constexpr std::size_t kSpread = 32;  // fewer are sorted by comparison

    // Keeps the k nearest and lowers the bound to the last of them.
    void cut() {
        Neighbour* const last = data_ + (k_ - 1);
        std::nth_element(data_, last, data_ + size_);
        size_ = k_;
        bound_ = last->key;
        limit_ = 2 * k_ + kSlack;
    }
    void reserve(std::size_t more) {
        if (size_ + more <= capacity_) return;
        std::vector<Neighbour> grown(2 * (capacity_ + more));
        std::copy(data_, data_ + size_, grown.begin());
        overflow_.swap(grown);
        data_ = overflow_.data();
        capacity_ = overflow_.size();
    }

    std::size_t k_;
    std::size_t limit_;  // the size at which the buffer is cut
    float bound_;
    std::size_t size_ = 0;
    std::size_t capacity_ = kInline;
    std::array<Neighbour, kInline> inline_;
    Neighbour* data_ = inline_.data();
    std::vector<Neighbour> overflow_;
};

}  // namespace lucerna
