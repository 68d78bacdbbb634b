// Makes random partitions of the space of emission numbers, and computes their density independently.
#pragma once

#include <array>
#include <vector>

#include "engine/base/sampler.h"
#include "photon/learned_emission.h"

namespace lucerna::testing {

// Makes `cuts` cuts of random blocks along random axes, with importances between 0 and 1, a third of them 0.
inline EmissionBlocks random_blocks(int cuts, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    EmissionBlocks blocks;
    const auto importance = [&] { return std::max(0.0, 1.5 * double{sampler.next()} - 0.5); };
    blocks.nodes[0].importance = importance();
    std::vector<std::uint32_t> undivided{0};
    for (int i = 0; i < cuts; ++i) {
        const auto which = static_cast<std::size_t>(sampler.next() * static_cast<float>(undivided.size()));
        const std::uint32_t node = undivided[which];
        const auto child = static_cast<std::uint32_t>(blocks.nodes.size());
        blocks.nodes[node] = {static_cast<int>(sampler.next() * 4), child, 0};
        blocks.nodes.push_back({-1, 0, importance()});
        blocks.nodes.push_back({-1, 0, importance()});
        undivided[which] = child;
        undivided.push_back(child + 1);
    }
    return blocks;
}

// An undivided block, as a box in the space of emission numbers.
struct NumberBox {
    std::array<double, 4> low{0, 0, 0, 0}, high{1, 1, 1, 1};
    double importance = 0;

    double volume() const {
        double v = 1;
        for (std::size_t a = 0; a < 4; ++a) v *= high[a] - low[a];
        return v;
    }
    double overlap(const NumberBox& other) const {
        double v = 1;
        for (std::size_t a = 0; a < 4; ++a) {
            v *= std::max(0.0, std::min(high[a], other.high[a]) - std::max(low[a], other.low[a]));
        }
        return v;
    }
    bool holds(const LeSampleU& u) const {
        const std::array<double, 4> x{u.position.x, u.position.y, u.direction.x, u.direction.y};
        for (std::size_t a = 0; a < 4; ++a) {
            if (!(x[a] >= low[a] && x[a] < high[a])) return false;
        }
        return true;
    }
};

inline std::vector<NumberBox> boxes_of(const EmissionBlocks& blocks) {
    std::vector<NumberBox> of_node(blocks.nodes.size());
    std::vector<NumberBox> undivided;
    for (std::size_t i = 0; i < blocks.nodes.size(); ++i) {
        const EmissionBlocks::Node& node = blocks.nodes[i];
        if (node.axis < 0) {
            of_node[i].importance = node.importance;
            undivided.push_back(of_node[i]);
            continue;
        }
        const auto axis = static_cast<std::size_t>(node.axis);
        NumberBox lower = of_node[i], upper = of_node[i];
        lower.high[axis] = upper.low[axis] = 0.5 * (lower.low[axis] + lower.high[axis]);
        of_node[node.child] = lower;
        of_node[node.child + 1] = upper;
    }
    return undivided;
}

inline LeSampleU emit_numbers(std::uint64_t seed, std::uint32_t i) {
    Sampler sampler = Sampler(seed, Purpose::test, 1, i);
    return {sampler.next2(), sampler.next2(), sampler.bits()};
}

}  // namespace lucerna::testing
