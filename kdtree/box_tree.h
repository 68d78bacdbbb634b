// A tree of boxes over blocks of points, in which photons are looked up.
//
// The points keep their order. Sixteen consecutive points form a block, eight consecutive blocks are the
// children of an 8-wide node, and eight nodes those of another, up to a single root. The indices of children
// are implicit, so the tree stores only boxes and is correct for any order. It is fast for an order in which
// neighbours in memory are neighbours in space, which `box_order` finds.
//
// Blocks and nodes store each coordinate of all their members contiguously, so that a measure processes all
// of them at once. The caller supplies the measure of a search, which returns the keys of a block's points
// and lower bounds of those under a box. Each point carries a payload of 32 bits that only the measure
// interprets. Where payloads encode vectors (for example directions), the higher nodes also have boxes of
// these vectors, so that a measure can cull by them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "engine/base/float_traps.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"

namespace lucerna {

inline constexpr std::size_t kBlock = 16;     // points in a block
inline constexpr std::size_t kNodeWidth = 8;  // boxes in a node

using BlockKeys = std::array<float, kBlock>;
using Node8Keys = std::array<float, kNodeWidth>;

// Sixteen points. Missing points of the last block are NaN.
struct alignas(64) PointBlock {
    std::array<float, kBlock> x, y, z;
    std::array<std::uint32_t, kBlock> payload;
};

// Eight boxes. Missing boxes are infinitely far away: from +infinity to -infinity.
struct alignas(32) BoxNode8 {
    std::array<float, kNodeWidth> low_x, low_y, low_z, high_x, high_y, high_z;
};

struct BoxTree {
    std::vector<PointBlock> blocks;
    // Node i of level 0 holds the blocks from i·kNodeWidth on, and node i of a higher level the nodes from
    // i·kNodeWidth on of the level below. The highest level is one node; without points there are no levels.
    std::vector<std::vector<BoxNode8>> levels;
    // The boxes around the payloads' vectors: [i] belongs to levels[i + 1]. Over single blocks they do not
    // pay.
    std::vector<std::vector<BoxNode8>> payloads;
    std::size_t size = 0;  // number of points
};

// Decodes a payload into a finite vector.
using PayloadPlace = std::function<V3f(std::uint32_t)>;

// Requires finite `points` and as many `payloads`. Without `place` there are no boxes around payloads.
BoxTree build_box_tree(std::span<const V3f> points, std::span<const std::uint32_t> payloads,
                       const Workers& workers, const PayloadPlace& place = {});

// Returns an order of the points that makes a good tree: [new place] → old place. It does not depend on the
// number of threads and is idempotent: points in this order stay where they are. At most 2^32 - 1 points.
std::vector<std::uint32_t> box_order(std::span<const V3f> points, const Workers& workers);

// A measure has
//   BlockKeys keys(const PointBlock&) const    the key of each point; an infinite or NaN key does not count
//   Node8Keys bounds(const BoxNode8&) const    for each box, a lower bound of the keys of the points inside
//   it
// and, if it uses the payloads' vectors,
//   Node8Keys bounds(const BoxNode8&, const BoxNode8& payloads) const
// where keys are not negative. `take(keys, index of the first)` gets every block that may hold a key up to
// `bound` (finite), and returns the new bound. The nearest boxes come first, so that the bound shrinks soon.
template <typename Measure, typename Take>
void search_nearest(const BoxTree& tree, const Measure& measure, float bound, Take&& take);

// As above with a fixed bound, and with the blocks in their order.
template <typename Measure, typename Take>
void search_all(const BoxTree& tree, const Measure& measure, float bound, Take&& take);

// Returns squared distances from x to the boxes of a node. They never exceed the squared distance of a point
// inside as a measure computes it from the same differences in the same order, because rounding is monotone.
inline Node8Keys box_distances2(const BoxNode8& node, const V3f& x) {
    Node8Keys d2;
    for (std::size_t i = 0; i < kNodeWidth; ++i) {
        const float dx = std::max(std::max(node.low_x[i] - x.x, x.x - node.high_x[i]), 0.0F);
        const float dy = std::max(std::max(node.low_y[i] - x.y, x.y - node.high_y[i]), 0.0F);
        const float dz = std::max(std::max(node.low_z[i] - x.z, x.z - node.high_z[i]), 0.0F);
        d2[i] = dx * dx + dy * dy + dz * dz;
    }
    return d2;
}

namespace box_tree {

// An entry of the traversal's stack: a block (level 0) or a node (one above its level).
struct StackEntry {
    float bound;  // lower bound of all keys in it
    std::uint32_t index;
    std::uint32_t level;
};

// A traversal of 2^32 points is ten levels deep and leaves at most seven entries on each.
inline constexpr std::size_t kMostEntries = 80;

// Prefetches the block while other work is done.
inline void fetch(const PointBlock& block) {
    for (const auto* part : {block.x.data(), block.y.data(), block.z.data()}) __builtin_prefetch(part);
    __builtin_prefetch(block.payload.data());
}

// Returns lower bounds of the keys under a node, `level` levels above the blocks.
template <typename Measure>
Node8Keys bounds(const BoxTree& tree, const Measure& measure, std::size_t level, std::size_t index) {
    const BoxNode8& node = tree.levels[level][index];
    if constexpr (requires { measure.bounds(node, node); }) {
        if (level > 0 && !tree.payloads.empty()) return measure.bounds(node, tree.payloads[level - 1][index]);
    }
    return measure.bounds(node);
}

// Visits all entries whose bound is no more than `bound`: either the nearest first, where take() returns the
// lowered bound, or in the order of storage.
template <bool nearest_first, typename Measure, typename Take>
void search(const BoxTree& tree, const Measure& measure, float bound, Take&& take) {
    const FloatTraps none(kNoFaults);  // missing members are NaN or infinite, and computed with
    std::array<StackEntry, kMostEntries> places;
    std::size_t size = 0;
    if (!tree.levels.empty()) places[size++] = {0, 0, static_cast<std::uint32_t>(tree.levels.size())};
    while (size > 0) {
        const StackEntry place = places[--size];
        if (nearest_first && !(place.bound <= bound)) continue;
        if (place.level == 0) {
            const BlockKeys keys = measure.keys(tree.blocks[place.index]);
            const auto first = place.index * static_cast<std::uint32_t>(kBlock);
            if constexpr (nearest_first) {
                bound = take(keys, first);
            } else {
                take(keys, first);
            }
            continue;
        }
        const Node8Keys near = bounds(tree, measure, place.level - 1, place.index);
        const auto child = [&](std::size_t i) {
            return StackEntry{
                near[i], place.index * static_cast<std::uint32_t>(kNodeWidth) + static_cast<std::uint32_t>(i),
                place.level - 1};
        };
        if constexpr (nearest_first) {
            // Pushes the boxes that matter, with the nearest on top.
            const std::size_t bottom = size;
            for (std::size_t i = 0; i < kNodeWidth; ++i) {
                if (!(near[i] <= bound)) continue;
                if (place.level == 1) fetch(tree.blocks[place.index * kNodeWidth + i]);
                std::size_t at = size++;
                for (; at > bottom && places[at - 1].bound < near[i]; --at) places[at] = places[at - 1];
                places[at] = child(i);
            }
        } else {
            for (std::size_t i = kNodeWidth; i-- > 0;) {
                if (near[i] <= bound) places[size++] = child(i);
            }
        }
    }
}

}  // namespace box_tree

template <typename Measure, typename Take>
void search_nearest(const BoxTree& tree, const Measure& measure, float bound, Take&& take) {
    box_tree::search<true>(tree, measure, bound, take);
}

template <typename Measure, typename Take>
void search_all(const BoxTree& tree, const Measure& measure, float bound, Take&& take) {
    box_tree::search<false>(tree, measure, bound, take);
}

}  // namespace lucerna
