// The order of a kd-tree: a range of points is cut across the longest side of its box, as near to the middle
// as the blocks and fans of a BoxTree allow, until a block is left.
//
// Ties go to the lower old place, and within a block the old order stays. So points that are in order already
// come out as they went in: of the points with the coordinate of a cut, those that went left the first time
// have the lower places now.
#include <algorithm>

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

// Puts the lower part of the range first; returns how many that are.
std::size_t cut(Entries range) {
    const std::size_t middle = place_of_cut(range.size());
    const unsigned axis = longest_axis(range);
    std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(middle), range.end(),
                     [axis](const Entry& a, const Entry& b) {
                         return a.p[axis] < b.p[axis] || (a.p[axis] == b.p[axis] && a.index < b.index);
                     });
    return middle;
}

void order(Entries range) {
    if (range.size() <= kBlock) {
        std::sort(range.begin(), range.end(),
                  [](const Entry& a, const Entry& b) { return a.index < b.index; });
        return;
    }
    const std::size_t middle = cut(range);
    order(range.first(middle));
    order(range.subspan(middle));
}

// Cuts all ranges in two, side by side.
void cut_all(std::vector<Entries>& ranges, const Workers& workers) {
    std::vector<Entries> halves(2 * ranges.size());
    parallel_chunks(workers, static_cast<std::int64_t>(ranges.size()), [&](std::int64_t chunk) {
        const auto i = static_cast<std::size_t>(chunk);
        // The last part of a range that just overflows its fan may be small, even empty.
        const std::size_t middle = ranges[i].size() > kBlock ? cut(ranges[i]) : ranges[i].size();
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
    parallel_chunks(workers, static_cast<std::int64_t>(ranges.size()),
                    [&](std::int64_t chunk) { order(ranges[static_cast<std::size_t>(chunk)]); });

    std::vector<std::uint32_t> result(entries.size());
    for_each_place(entries.size(), workers, [&](std::size_t i) { result[i] = entries[i].index; });
    return result;
}

}  // namespace lucerna
