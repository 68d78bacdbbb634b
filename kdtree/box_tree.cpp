#include "kdtree/box_tree.h"

#include <algorithm>

#include "engine/base/error.h"
#include "kdtree/node_order.h"

namespace lucerna {
namespace {

constexpr float kNoPoint = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::int64_t kGrain = 1024;  // blocks or nodes per task

constexpr std::size_t groups(std::size_t n, std::size_t size) {
    return (n + size - 1) / size;
}

PointBlock make_block(std::span<const V3f> points, std::span<const std::uint32_t> payloads) {
    PointBlock block;
    block.x.fill(kNoPoint);
    block.y.fill(kNoPoint);
    block.z.fill(kNoPoint);
    block.payload.fill(0);
    for (std::size_t i = 0; i < points.size(); ++i) {
        block.x[i] = points[i].x;
        block.y[i] = points[i].y;
        block.z[i] = points[i].z;
        block.payload[i] = payloads[i];
    }
    return block;
}

BoxNode8 empty_node() {
    BoxNode8 node;
    for (auto* low : {&node.low_x, &node.low_y, &node.low_z}) low->fill(kInfinity);
    for (auto* high : {&node.high_x, &node.high_y, &node.high_z}) high->fill(-kInfinity);
    return node;
}

void put(BoxNode8& node, std::size_t i, const Box3f& box) {
    node.low_x[i] = box.min.x;
    node.low_y[i] = box.min.y;
    node.low_z[i] = box.min.z;
    node.high_x[i] = box.max.x;
    node.high_y[i] = box.max.y;
    node.high_z[i] = box.max.z;
}

// Returns the box around all boxes of a node; missing ones do not widen it.
Box3f around(const BoxNode8& node) {
    const auto low = [](const auto& values) { return *std::min_element(values.begin(), values.end()); };
    const auto high = [](const auto& values) { return *std::max_element(values.begin(), values.end()); };
    return {V3f(low(node.low_x), low(node.low_y), low(node.low_z)),
            V3f(high(node.high_x), high(node.high_y), high(node.high_z))};
}

// Returns nodes over `count` items, where box_of(i) is the box around the i-th.
template <typename BoxOf>
std::vector<BoxNode8> make_level(std::size_t count, const Workers& workers, BoxOf&& box_of) {
    std::vector<BoxNode8> nodes(groups(count, kNodeWidth));
    parallel_each(workers, nodes.size(), kGrain, [&](std::size_t i) {
        nodes[i] = empty_node();
        const std::size_t first = i * kNodeWidth;
        for (std::size_t j = first; j < std::min(count, first + kNodeWidth); ++j) {
            put(nodes[i], j - first, box_of(j));
        }
    });
    return nodes;
}

}  // namespace

BoxTree build_box_tree(std::span<const V3f> points, std::span<const std::uint32_t> payloads,
                       const Workers& workers, const PayloadPlace& place) {
    BoxTree tree;
    tree.size = points.size();
    if (points.empty()) return tree;
    const auto members = [&](std::size_t block) {
        const std::size_t first = block * kBlock;
        return std::pair(first, std::min(kBlock, points.size() - first));
    };
    tree.blocks.resize(groups(points.size(), kBlock));
    parallel_each(workers, tree.blocks.size(), kGrain, [&](std::size_t i) {
        const auto [first, count] = members(i);
        tree.blocks[i] = make_block(points.subspan(first, count), payloads.subspan(first, count));
    });

    // Builds boxes around the points of each block, then around the boxes of each node, up to one node.
    tree.levels.push_back(make_level(tree.blocks.size(), workers, [&](std::size_t block) {
        const auto [first, count] = members(block);
        Box3f box;
        for (const V3f& p : points.subspan(first, count)) box.extendBy(p);
        return box;
    }));
    while (tree.levels.back().size() > 1) {
        const std::vector<BoxNode8>& below = tree.levels.back();
        std::vector<BoxNode8> level =
            make_level(below.size(), workers, [&](std::size_t node) { return around(below[node]); });
        tree.levels.push_back(std::move(level));
    }
    if (!place) return tree;
    for (std::size_t i = 1; i < tree.levels.size(); ++i) {
        constexpr std::size_t kUnderANode = kNodeWidth * kBlock;
        tree.payloads.push_back(make_level(tree.levels[i - 1].size(), workers, [&](std::size_t node) {
            if (i > 1) return around(tree.payloads[i - 2][node]);
            const std::size_t first = node * kUnderANode;
            Box3f box;
            for (const std::uint32_t payload :
                 payloads.subspan(first, std::min(kUnderANode, payloads.size() - first)))
                box.extendBy(place(payload));
            return box;
        }));
    }
    return tree;
}

std::vector<std::uint32_t> box_order(std::span<const V3f> points, const Workers& workers) {
    check_node_order_size(points.size());
    std::vector<OrderEntry<3>> entries(points.size());
    constexpr std::int64_t kEntryGrain = 1 << 14;
    parallel_each(workers, points.size(), kEntryGrain, [&](std::size_t i) {
        entries[i] = {{points[i].x, points[i].y, points[i].z}, static_cast<std::uint32_t>(i)};
    });
    return node_order<3>(std::move(entries), workers);
}

}  // namespace lucerna
