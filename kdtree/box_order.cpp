// The order of a kd-tree: a range of points is cut across the longest side of its box, as near to the middle
// as the blocks and fans of a BoxTree allow, until a block is left.
//
// Ties go to the lower old place, and within a block the old order stays. So points that are in order already
// come out as they went in: of the points with the coordinate of a cut, those that went left the first time
// have the lower places now.
#include <algorithm>
#include <array>
#include <bit>

#include "engine/base/error.h"
#include "kdtree/box_tree.h"

namespace lucerna {
namespace {

struct Entry {
    V3f p;
    std::uint32_t index;
};
using Entries = std::span<Entry>;

// Where to cut a range of more than kBlock points: between two children of the fan that is over them.
std::size_t place_of_cut(std::size_t n) {
    std::size_t child = kBlock;
    while (child * kFan < n) child *= kFan;
    const std::size_t children = (n + child - 1) / child;  // 2 at least
    return children / 2 * child;
}

unsigned longest_axis(Entries range) {
    Box3f box;
    for (const Entry& e : range) box.extendBy(e.p);
    return box.majorAxis();
}

// A coordinate and, for ties, the old place, as one number of the same order: entries are told apart by one
// comparison that a processor need not guess.
std::uint64_t key_of(const Entry& e, unsigned axis) {
    const auto bits = std::bit_cast<std::uint32_t>(e.p[axis] + 0.0F);  // -0 becomes 0
    const std::uint32_t ordered = (bits >> 31) != 0 ? ~bits : bits | 0x80000000U;
    return std::uint64_t{ordered} << 32 | e.index;
}

// What cutting a range needs beside it, kept between cuts.
struct Scratch {
    std::vector<std::uint64_t> keys, between;
    std::vector<Entry> upper;
    void hold(std::size_t n) {
        if (keys.size() >= n) return;
        keys.resize(n);
        between.resize(n);
        upper.resize(n);
    }
};

// The key that would be at `place` if they were sorted. A sample tells between which two keys it lies, a pass
// without branches collects those [Floyd and Rivest, "Expected time bounds for selection", 1975].
std::uint64_t key_at(std::span<std::uint64_t> keys, std::size_t place, std::span<std::uint64_t> between) {
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

// Puts the lower part of the range first; returns how many that are.
std::size_t cut(Entries range, Scratch& scratch) {
    const std::size_t n = range.size(), middle = place_of_cut(n);
    const unsigned axis = longest_axis(range);
    scratch.hold(n);
    for (std::size_t i = 0; i < n; ++i) scratch.keys[i] = key_of(range[i], axis);
    const std::uint64_t first_above = key_at(std::span(scratch.keys).first(n), middle, scratch.between);
    std::size_t lower = 0, upper = 0;
    for (std::size_t i = 0; i < n; ++i) {
        const Entry e = range[i];
        const bool above = key_of(e, axis) >= first_above;
        range[lower] = e;  // lower <= i
        scratch.upper[upper] = e;
        lower += static_cast<std::size_t>(!above);
        upper += static_cast<std::size_t>(above);
    }
    std::copy_n(scratch.upper.begin(), upper, range.begin() + static_cast<std::ptrdiff_t>(lower));
    return middle;
}

void order(Entries range, Scratch& scratch) {
    if (range.size() <= kBlock) {
        std::sort(range.begin(), range.end(),
                  [](const Entry& a, const Entry& b) { return a.index < b.index; });
        return;
    }
    const std::size_t middle = cut(range, scratch);
    order(range.first(middle), scratch);
    order(range.subspan(middle), scratch);
}

// Cuts all ranges in two, side by side.
void cut_all(std::vector<Entries>& ranges, const Workers& workers) {
    std::vector<Entries> halves(2 * ranges.size());
    parallel_chunks(workers, static_cast<std::int64_t>(ranges.size()), [&](std::int64_t chunk) {
        const auto i = static_cast<std::size_t>(chunk);
        // The last part of a range that just overflows its fan may be small, even empty.
        Scratch scratch;
        const std::size_t middle = ranges[i].size() > kBlock ? cut(ranges[i], scratch) : ranges[i].size();
        halves[2 * i] = ranges[i].first(middle);
        halves[2 * i + 1] = ranges[i].subspan(middle);
    });
    ranges.swap(halves);
}

template <typename Body>
void for_each_place(std::size_t n, const Workers& workers, Body&& body) {
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_ranges(workers, static_cast<std::int64_t>(n), kGrain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t) {
                        for (std::int64_t i = begin; i < end; ++i) body(static_cast<std::size_t>(i));
                    });
}

}  // namespace

std::vector<std::uint32_t> box_order(std::span<const V3f> points, const Workers& workers) {
    constexpr std::size_t kMost = 0xffffffffU;
    if (points.size() > kMost) {
        throw InputError(
            fmt::format("{} points are too many for a tree; at most {} fit", points.size(), kMost));
    }
    std::vector<Entry> entries(points.size());
    for_each_place(points.size(), workers, [&](std::size_t i) {
        entries[i] = {points[i], static_cast<std::uint32_t>(i)};
    });

    // Cut until there is work for many threads; from there each range is one thread's.
    constexpr std::size_t kRanges = 256;
    constexpr std::size_t kLeast = 4096;  // points in a range on average
    std::vector<Entries> ranges{entries};
    while (ranges.size() < std::min(kRanges, entries.size() / kLeast)) cut_all(ranges, workers);
    parallel_chunks(workers, static_cast<std::int64_t>(ranges.size()), [&](std::int64_t chunk) {
        Scratch scratch;
        order(ranges[static_cast<std::size_t>(chunk)], scratch);
    });

    std::vector<std::uint32_t> result(entries.size());
    for_each_place(entries.size(), workers, [&](std::size_t i) { result[i] = entries[i].index; });
    return result;
}

}  // namespace lucerna
