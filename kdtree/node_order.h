// The order of a kd-tree. A range of points is cut across the longest side of its box, as close to the middle
// as blocks of sixteen under 8-wide nodes (box_tree.h) allow, until a block remains. Points may have any
// dimension: a place, or a place and a direction.
//
// Ties go to the lower old place, and within a block the old order is kept, so that ordered points keep their
// places: among points with the coordinate of a cut, those that went left the first time have the lower
// places the second time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/base/error.h"
#include "engine/base/parallel.h"
#include "engine/ranks/shared_work.h"
#include "kdtree/box_tree.h"

namespace lucerna {

template <std::size_t K>
struct OrderEntry {
    std::array<float, K> p;  // finite
    std::uint32_t index;     // old place
};

namespace node_order_detail {

template <std::size_t K>
using Entries = std::span<OrderEntry<K>>;

// Returns where to cut a range of more than kBlock points: between two children of the node that holds them.
inline std::size_t place_of_cut(std::size_t n) {
    std::size_t child = kBlock;
    while (child * kNodeWidth < n) child *= kNodeWidth;
    const std::size_t children = (n + child - 1) / child;  // at least 2
    return children / 2 * child;
}

// Among sides of equal length up to rounding, the first is cut, so that a cube is cut alike at any scale and
// on any processor.
inline constexpr float kAsLong = 0.9999F;

template <std::size_t K>
std::size_t longest_axis(Entries<K> range) {
    std::array<float, K> low = range[0].p, high = range[0].p;
    for (const OrderEntry<K>& e : range) {
        for (std::size_t a = 0; a < K; ++a) {
            low[a] = std::min(low[a], e.p[a]);
            high[a] = std::max(high[a], e.p[a]);
        }
    }
    float longest = 0;
    for (std::size_t a = 0; a < K; ++a) longest = std::max(longest, high[a] - low[a]);
    std::size_t axis = 0;
    while (high[axis] - low[axis] < kAsLong * longest) ++axis;  // ends at the longest side at the latest
    return axis;
}

// Combines a coordinate and, for ties, the old place into one number of the same order, so that one
// comparison without a branch tells entries apart.
template <std::size_t K>
std::uint64_t key_of(const OrderEntry<K>& e, std::size_t axis) {
    const auto bits = std::bit_cast<std::uint32_t>(e.p[axis] + 0.0F);  // -0 becomes 0
    const std::uint32_t ordered = (bits >> 31) != 0 ? ~bits : bits | 0x80000000U;
    return std::uint64_t{ordered} << 32 | e.index;
}

// Scratch memory of cuts, reused between them.
template <std::size_t K>
struct Scratch {
    std::vector<std::uint64_t> keys, between;
    std::vector<OrderEntry<K>> upper;
    void hold(std::size_t n) {
        if (keys.size() >= n) return;
        keys.resize(n);
        between.resize(n);
        upper.resize(n);
    }
};

// Returns the key that would be at `place` after sorting. A sample gives two keys that bracket it, and a pass
// without branches collects the keys between them [Floyd and Rivest 1975].
inline std::uint64_t key_at(std::span<std::uint64_t> keys, std::size_t place,
                            std::span<std::uint64_t> between) {
    constexpr std::size_t kSample = 64, kMargin = 8;  // two standard deviations of a sample's median
    if (keys.size() >= 8 * kSample) {
        std::array<std::uint64_t, kSample> sample;
        for (std::size_t i = 0; i < kSample; ++i) sample[i] = keys[i * keys.size() / kSample];
        std::sort(sample.begin(), sample.end());
        const std::size_t rank = place * kSample / keys.size();
        const std::uint64_t low = rank < kMargin ? 0 : sample[rank - kMargin];
        const std::uint64_t high = rank + kMargin >= kSample ? ~std::uint64_t{0} : sample[rank + kMargin];
        std::size_t below = 0, count = 0;
        for (const std::uint64_t key : keys) {
            between[count] = key;
            below += static_cast<std::size_t>(key < low);
            count += static_cast<std::size_t>((key >= low) & (key <= high));
        }
        if (place >= below && place - below < count) {
            keys = between.first(count);
            place -= below;
        }
    }
    const auto at = keys.begin() + static_cast<std::ptrdiff_t>(place);
    std::nth_element(keys.begin(), at, keys.end());
    return *at;
}

// Moves the lower part of the range to its front and returns its size.
template <std::size_t K>
std::size_t cut(Entries<K> range, Scratch<K>& scratch) {
    const std::size_t n = range.size(), middle = place_of_cut(n);
    const std::size_t axis = longest_axis<K>(range);
    scratch.hold(n);
    for (std::size_t i = 0; i < n; ++i) scratch.keys[i] = key_of<K>(range[i], axis);
    const std::uint64_t first_above = key_at(std::span(scratch.keys).first(n), middle, scratch.between);
    std::size_t lower = 0, upper = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const OrderEntry<K> e = range[i];
        const bool above = key_of<K>(e, axis) >= first_above;
        range[lower] = e;  // lower <= i
        scratch.upper[upper] = e;
        lower += static_cast<std::size_t>(!above);
        upper += static_cast<std::size_t>(above);
    }
    std::copy_n(scratch.upper.begin(), upper, range.begin() + static_cast<std::ptrdiff_t>(lower));
    return middle;
}

template <std::size_t K>
void order(Entries<K> range, Scratch<K>& scratch) {
    if (range.size() <= kBlock) {
        std::sort(range.begin(), range.end(),
                  [](const OrderEntry<K>& a, const OrderEntry<K>& b) { return a.index < b.index; });
        return;
    }
    const std::size_t middle = cut<K>(range, scratch);
    order<K>(range.first(middle), scratch);
    order<K>(range.subspan(middle), scratch);
}

// Cuts all ranges in two, in parallel.
template <std::size_t K>
void cut_all(std::vector<Entries<K>>& ranges, const Workers& workers) {
    std::vector<Entries<K>> halves(2 * ranges.size());
    parallel_chunks(workers, static_cast<std::int64_t>(ranges.size()), [&](std::int64_t chunk) {
        const auto i = static_cast<std::size_t>(chunk);
        // The last part of a range that barely overflows its node may be small or empty.
        Scratch<K> scratch;
        const std::size_t middle = ranges[i].size() > kBlock ? cut<K>(ranges[i], scratch) : ranges[i].size();
        halves[2 * i] = ranges[i].first(middle);
        halves[2 * i + 1] = ranges[i].subspan(middle);
    });
    ranges.swap(halves);
}

}  // namespace node_order_detail

// Throws InputError for more points than 32 bits can number.
inline void check_node_order_size(std::size_t points) {
    constexpr std::size_t kMost = 0xffffffffU;
    if (points > kMost) {
        throw InputError(fmt::format("{} points are too many for a tree; at most {} fit", points, kMost));
    }
}

// Returns [new place] → old place. It does not depend on the number of threads and ranks.
template <std::size_t K>
std::vector<std::uint32_t> node_order(std::vector<OrderEntry<K>> entries, const Workers& workers) {
    namespace detail = node_order_detail;
    check_node_order_size(entries.size());
    // Ranges are cut until there is work for many threads; from then on each range is one thread's.
    constexpr std::size_t kRanges = 256;
    constexpr std::size_t kLeast = 4096;  // average points per range
    std::vector<detail::Entries<K>> ranges{entries};
    while (ranges.size() < std::min(kRanges, entries.size() / kLeast)) detail::cut_all<K>(ranges, workers);
    // Among the ranks of a parallel job, each range belongs to one rank if the set is worth sending the
    // order.
    constexpr std::size_t kWorthSending = std::size_t{1} << 17;
    shared_chunks(
        entries.size() >= kWorthSending ? workers : workers.alone(), "order of points",
        static_cast<std::int64_t>(ranges.size()), ResultsGo::to_all_ranks,
        [&](std::int64_t chunk) {
            detail::Scratch<K> scratch;
            detail::order<K>(ranges[static_cast<std::size_t>(chunk)], scratch);
        },
        [&](std::int64_t chunk, auto& archive) {
            const detail::Entries<K> range = ranges[static_cast<std::size_t>(chunk)];
            std::vector<std::uint32_t> indices(range.size());
            for (std::size_t i = 0; i < range.size(); ++i) indices[i] = range[i].index;
            std::span<std::uint32_t> all(indices);
            archive(all);
            for (std::size_t i = 0; i < range.size(); ++i) range[i].index = indices[i];
        });

    std::vector<std::uint32_t> result(entries.size());
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_each(workers, entries.size(), kGrain, [&](std::size_t i) { result[i] = entries[i].index; });
    return result;
}

}  // namespace lucerna
