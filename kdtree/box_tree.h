// Points in blocks, and boxes over the blocks: the tree that photons are looked up in.
//
// The points keep the order they come in. Sixteen in a row make a block, eight blocks in a row lie under one
// fan of boxes, eight fans under another, up to a single one: what lies where follows from the numbers alone,
// so that the tree stores nothing but boxes, and is right for any order. It is fast for an order in which
// neighbours in memory are neighbours in space: `box_order` finds one.
//
// Blocks and fans hold one coordinate of all their members beside each other, so that a measure works on all
// of them at once. A search is asked with a measure of the caller's own, which says how far the points of a
// block are and how near those under a box could be; each point carries 32 bits, its label, that mean
// something to that measure only. Where labels stand for places of their own (directions, say), boxes around
// those lie beside the boxes of the higher fans: what no label under them would let count is passed by.
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

inline constexpr std::size_t kBlock = 16;  // points in a block
inline constexpr std::size_t kFan = 8;     // boxes in a fan

using BlockKeys = std::array<float, kBlock>;
using FanKeys = std::array<float, kFan>;

// Sixteen points. In the last block, points that do not exist are NaN.
struct alignas(64) PointBlock {
    std::array<float, kBlock> x, y, z;
    std::array<std::uint32_t, kBlock> label;
};

// Eight boxes. Boxes that do not exist are infinitely far away: from +infinity to -infinity.
struct alignas(32) BoxFan {
    std::array<float, kFan> low_x, low_y, low_z, high_x, high_y, high_z;
};

struct BoxTree {
    std::vector<PointBlock> blocks;
    // Fan i of level 0 is over the blocks from i·kFan, fan i of a higher level over the fans from i·kFan of
    // the level below. The highest level is one fan; no points, no levels.
    std::vector<std::vector<BoxFan>> levels;
    // Around what the labels stand for: [i] goes with levels[i + 1]. Over single blocks it would not pay.
    std::vector<std::vector<BoxFan>> labels;
    std::size_t size = 0;  // points
};

// The place, finite, that a label stands for.
using LabelPlace = std::function<V3f(std::uint32_t)>;

// `points` are finite; `labels` as many as there are points. Without `place` there are no boxes around
// labels.
BoxTree build_box_tree(std::span<const V3f> points, std::span<const std::uint32_t> labels,
                       const Workers& workers, const LabelPlace& place = {});

// An order of the points that makes a good tree: [new place] → old place. The same for any number of threads,
// and settled: points that lie in this order already stay where they are. At most 2^32 - 1 points.
std::vector<std::uint32_t> box_order(std::span<const V3f> points, const Workers& workers);

// A measure has
//   BlockKeys keys(const PointBlock&) const    the key of each point; infinite or NaN: does not count
//   FanKeys   bounds(const BoxFan&) const      for each box, at most the key of any point inside it
// and, if it goes by what labels stand for,
//   FanKeys   bounds(const BoxFan&, const BoxFan& labels) const
// where keys are not negative. `take(keys, index of the first)` gets every block that may hold a key up to
// `bound` (finite), and returns the bound from then on. The nearest boxes come first, so that the bound
// shrinks soon.
template <typename Measure, typename Take>
void search_nearest(const BoxTree& tree, const Measure& measure, float bound, Take&& take);

// The same with a fixed bound, the blocks in their order.
template <typename Measure, typename Take>
void search_all(const BoxTree& tree, const Measure& measure, float bound, Take&& take);

// Squared distances from x to the boxes of a fan. Never more than the squared distance of a point inside,
// as a measure computes it from the same differences in the same order: rounding keeps their order.
inline FanKeys box_distances2(const BoxFan& fan, const V3f& x) {
    FanKeys d2;
    for (std::size_t i = 0; i < kFan; ++i) {
        const float dx = std::max(std::max(fan.low_x[i] - x.x, x.x - fan.high_x[i]), 0.0F);
        const float dy = std::max(std::max(fan.low_y[i] - x.y, x.y - fan.high_y[i]), 0.0F);
        const float dz = std::max(std::max(fan.low_z[i] - x.z, x.z - fan.high_z[i]), 0.0F);
        d2[i] = dx * dx + dy * dy + dz * dz;
    }
    return d2;
}

namespace box_tree {

// A place still to be looked at: a block (level 0) or a fan (one above its level).
struct Place {
    float bound;  // of all keys in it
    std::uint32_t index;
    std::uint32_t level;
};

// A walk through 2^32 points is ten levels deep, and leaves at most seven places behind on each.
inline constexpr std::size_t kMostPlaces = 80;

// Has the processor fetch the block while other work is done.
inline void fetch(const PointBlock& block) {
    for (const auto* part : {block.x.data(), block.y.data(), block.z.data()}) __builtin_prefetch(part);
    __builtin_prefetch(block.label.data());
}

// How near the points under a fan can be, `level` levels above the blocks.
template <typename Measure>
FanKeys bounds(const BoxTree& tree, const Measure& measure, std::size_t level, std::size_t index) {
    const BoxFan& fan = tree.levels[level][index];
    if constexpr (requires { measure.bounds(fan, fan); }) {
        if (level > 0 && !tree.labels.empty()) return measure.bounds(fan, tree.labels[level - 1][index]);
    }
    return measure.bounds(fan);
}

}  // namespace box_tree

template <typename Measure, typename Take>
void search_nearest(const BoxTree& tree, const Measure& measure, float bound, Take&& take) {
    const FloatTraps none(
        kNoFaults);  // places that are not filled are NaN or infinite; all are computed with
    std::array<box_tree::Place, box_tree::kMostPlaces> places;
    std::size_t size = 0;
    if (!tree.levels.empty()) places[size++] = {0, 0, static_cast<std::uint32_t>(tree.levels.size())};
    while (size > 0) {
        const box_tree::Place place = places[--size];
        if (!(place.bound <= bound)) continue;
        if (place.level == 0) {
            const BlockKeys keys = measure.keys(tree.blocks[place.index]);
            bound = take(keys, place.index * static_cast<std::uint32_t>(kBlock));
            continue;
        }
        // Put the boxes that matter on the stack, the nearest on top.
        const FanKeys bounds = box_tree::bounds(tree, measure, place.level - 1, place.index);
        const std::size_t bottom = size;
        for (std::size_t i = 0; i < kFan; ++i) {
            if (!(bounds[i] <= bound)) continue;
            if (place.level == 1) box_tree::fetch(tree.blocks[place.index * kFan + i]);
            std::size_t at = size++;
            for (; at > bottom && places[at - 1].bound < bounds[i]; --at) places[at] = places[at - 1];
            places[at] = {bounds[i],
                          place.index * static_cast<std::uint32_t>(kFan) + static_cast<std::uint32_t>(i),
                          place.level - 1};
        }
    }
}

template <typename Measure, typename Take>
void search_all(const BoxTree& tree, const Measure& measure, float bound, Take&& take) {
    const FloatTraps none(kNoFaults);  // as in search_nearest
    std::array<box_tree::Place, box_tree::kMostPlaces> places;
    std::size_t size = 0;
    if (!tree.levels.empty()) places[size++] = {0, 0, static_cast<std::uint32_t>(tree.levels.size())};
    while (size > 0) {
        const box_tree::Place place = places[--size];
        if (place.level == 0) {
            take(measure.keys(tree.blocks[place.index]), place.index * static_cast<std::uint32_t>(kBlock));
            continue;
        }
        const FanKeys bounds = box_tree::bounds(tree, measure, place.level - 1, place.index);
        for (std::size_t i = kFan; i-- > 0;) {
            if (!(bounds[i] <= bound)) continue;
            places[size++] = {bounds[i],
                              place.index * static_cast<std::uint32_t>(kFan) + static_cast<std::uint32_t>(i),
                              place.level - 1};
        }
    }
}

}  // namespace lucerna
