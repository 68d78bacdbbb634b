#include "kdtree/box_tree.h"

#include <algorithm>

#include "engine/base/error.h"

namespace lucerna {
namespace {

constexpr float kNoPoint = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t kGrain = 1024;  // blocks or fans a thread takes at a time

constexpr std::size_t groups(std::size_t n, std::size_t size) {
    return (n + size - 1) / size;
}

PointBlock make_block(std::span<const V3f> points, std::span<const std::uint32_t> labels) {
    PointBlock block;
    block.x.fill(kNoPoint);
    block.y.fill(kNoPoint);
    block.z.fill(kNoPoint);
    block.label.fill(0);
    for (std::size_t i = 0; i < points.size(); ++i) {
        block.x[i] = points[i].x;
        block.y[i] = points[i].y;
        block.z[i] = points[i].z;
        block.label[i] = labels[i];
    }
    return block;
}

BoxFan empty_fan() {
    BoxFan fan;
    for (auto* low : {&fan.low_x, &fan.low_y, &fan.low_z}) low->fill(kInfinity);
    for (auto* high : {&fan.high_x, &fan.high_y, &fan.high_z}) high->fill(-kInfinity);
    return fan;
}

void put(BoxFan& fan, std::size_t i, const Box3f& box) {
    fan.low_x[i] = box.min.x;
    fan.low_y[i] = box.min.y;
    fan.low_z[i] = box.min.z;
    fan.high_x[i] = box.max.x;
    fan.high_y[i] = box.max.y;
    fan.high_z[i] = box.max.z;
}

// The box around all boxes of a fan. One that does not exist widens nothing.
Box3f around(const BoxFan& fan) {
    const auto low = [](const auto& values) { return *std::min_element(values.begin(), values.end()); };
    const auto high = [](const auto& values) { return *std::max_element(values.begin(), values.end()); };
    return {V3f(low(fan.low_x), low(fan.low_y), low(fan.low_z)),
            V3f(high(fan.high_x), high(fan.high_y), high(fan.high_z))};
}

// Fans over `count` things, box_of(i) being the box around the i-th.
template <typename BoxOf>
std::vector<BoxFan> make_level(std::size_t count, const Workers& workers, BoxOf&& box_of) {
    std::vector<BoxFan> fans(groups(count, kFan));
    const auto each = [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            fans[i] = empty_fan();
            const std::size_t first = i * kFan;
            for (std::size_t j = first; j < std::min(count, first + kFan); ++j) {
                put(fans[i], j - first, box_of(j));
            }
        }
    };
    parallel_ranges(workers, static_cast<std::int64_t>(fans.size()), kGrain, each);
    return fans;
}

}  // namespace

BoxTree build_box_tree(std::span<const V3f> points, std::span<const std::uint32_t> labels,
                       const Workers& workers, const LabelPlace& place) {
    BoxTree tree;
    tree.size = points.size();
    if (points.empty()) return tree;
    const auto members = [&](std::size_t block) {
        const std::size_t first = block * kBlock;
        return std::pair(first, std::min(kBlock, points.size() - first));
    };
    tree.blocks.resize(groups(points.size(), kBlock));
    const auto fill = [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const auto [first, count] = members(i);
            tree.blocks[i] = make_block(points.subspan(first, count), labels.subspan(first, count));
        }
    };
    parallel_ranges(workers, static_cast<std::int64_t>(tree.blocks.size()), kGrain, fill);

    // Boxes around the points of each block, then around the boxes of each fan, up to one fan.
    tree.levels.push_back(make_level(tree.blocks.size(), workers, [&](std::size_t block) {
        const auto [first, count] = members(block);
        Box3f box;
        for (const V3f& p : points.subspan(first, count)) box.extendBy(p);
        return box;
    }));
    while (tree.levels.back().size() > 1) {
        const std::vector<BoxFan>& below = tree.levels.back();
        std::vector<BoxFan> level =
            make_level(below.size(), workers, [&](std::size_t fan) { return around(below[fan]); });
        tree.levels.push_back(std::move(level));
    }
    if (!place) return tree;
    for (std::size_t i = 1; i < tree.levels.size(); ++i) {
        constexpr std::size_t kUnderAFan = kFan * kBlock;
        tree.labels.push_back(make_level(tree.levels[i - 1].size(), workers, [&](std::size_t fan) {
            if (i > 1) return around(tree.labels[i - 2][fan]);
            const std::size_t first = fan * kUnderAFan;
            Box3f box;
            for (const std::uint32_t label :
                 labels.subspan(first, std::min(kUnderAFan, labels.size() - first)))
                box.extendBy(place(label));
            return box;
        }));
    }
    return tree;
}

}  // namespace lucerna
