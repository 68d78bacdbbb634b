// The k smallest keys seen so far, ties broken by index, so that the outcome does not depend on the order of
// visits.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace lucerna {

struct Neighbour {
    float key;  // squared distance, by whatever measure
    std::uint32_t index;

    bool operator<(const Neighbour& other) const {
        return key < other.key || (key == other.key && index < other.index);
    }
};

class NearestHeap {
  public:
    // Up to kInline neighbours live on the stack of the query; only a larger k allocates.
    explicit NearestHeap(std::size_t k) : k_(k) {
        assert(k > 0);
        if (k > kInline) overflow_.resize(k);
    }
    NearestHeap(const NearestHeap&) = delete;
    NearestHeap& operator=(const NearestHeap&) = delete;

    bool full() const { return size_ == k_; }
    std::size_t size() const { return size_; }
    // The largest key kept; infinite until the heap is full.
    float worst() const { return full() ? data()[0].key : INFINITY; }

    void offer(float key, std::uint32_t index) {
        const Neighbour candidate{key, index};
        Neighbour* first = data();
        if (!full()) {
            first[size_++] = candidate;
            if (full()) std::make_heap(first, first + size_);
        } else if (candidate < first[0]) {
            std::pop_heap(first, first + size_);
            first[size_ - 1] = candidate;
            std::push_heap(first, first + size_);
        }
    }

    // Nearest first. The heap must not be offered anything afterwards.
    std::span<const Neighbour> sorted() {
        std::sort(data(), data() + size_);
        return {data(), size_};
    }

  private:
    static constexpr std::size_t kInline = 256;
    Neighbour* data() { return k_ > kInline ? overflow_.data() : inline_.data(); }
    const Neighbour* data() const { return k_ > kInline ? overflow_.data() : inline_.data(); }

    std::size_t k_;
    std::size_t size_ = 0;
    std::array<Neighbour, kInline> inline_;
    std::vector<Neighbour> overflow_;
};

}  // namespace lucerna
