#include "photon/learned_emission.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>

#include "engine/base/cdf.h"
#include "engine/base/defensive.h"
#include "engine/system/hash.h"

namespace lucerna {
namespace {

// The masses of each node under the plain density and under the mixed one, as shares of the draws of all
// lights.
struct Masses {
    std::vector<double> plain, mixed;
};

// Returns the plain mass of every node, exactly half of its parent's.
std::vector<double> plain_masses(const EmissionBlocks& blocks, double root) {
    std::vector<double> plain(blocks.nodes.size());
    plain[0] = root;
    for (std::size_t i = 0; i < blocks.nodes.size(); ++i) {
        const EmissionBlocks::Node& node = blocks.nodes[i];
        if (node.axis < 0) continue;
        assert(node.child > i && node.child + 1 < blocks.nodes.size());
        plain[node.child] = plain[node.child + 1] = 0.5 * plain[i];
    }
    return plain;
}

double learned_mass(const EmissionBlocks& blocks, std::span<const double> plain) {
    double sum = 0;
    for (std::size_t i = 0; i < blocks.nodes.size(); ++i) {
        if (blocks.nodes[i].axis < 0) sum += plain[i] * blocks.nodes[i].importance;
    }
    return sum;
}

// Returns β · plain + (1 - β) · learned for every node, summed from the leaves upwards; β is the defensive
// weight. `scale` makes the learned masses of all lights sum to their plain ones.
std::vector<double> mixed_masses(const EmissionBlocks& blocks, std::span<const double> plain,
                                 double defensive_weight, double scale) {
    std::vector<double> mixed(plain.begin(), plain.end());
    for (std::size_t i = blocks.nodes.size(); i-- > 0;) {
        const EmissionBlocks::Node& node = blocks.nodes[i];
        mixed[i] = node.axis < 0 ? defensive_weight * plain[i] +
                                       (1 - defensive_weight) * scale * plain[i] * node.importance
                                 : mixed[node.child] + mixed[node.child + 1];
    }
    return mixed;
}

std::array<float*, 4> numbers(LeSampleU& u) {
    return {&u.position.x, &u.position.y, &u.direction.x, &u.direction.y};
}

}  // namespace

LearnedEmission::LearnedEmission(const Scene& scene, std::span<const EmissionBlocks> blocks) {
    assert(blocks.size() == scene.lights().size());
    std::vector<double> powers;
    powers.reserve(blocks.size());
    for (const auto& light : scene.lights()) powers.push_back(light->power());

    // Sum the masses of both densities over all lights.
    double plain = 0, learned = 0;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        plain += powers[i];
        learned += learned_mass(blocks[i], plain_masses(blocks[i], powers[i]));
    }
    const bool steers = learned > 0 && std::isfinite(plain / learned);
    const double share = steers ? double{kDefensiveWeight} : 1.0;
    const double scale = steers ? plain / learned : 0.0;

    // Build each light's tree, and weight the lights by the masses of their trees.
    std::vector<double> weights;
    weights.reserve(blocks.size());
    for (std::size_t i = 0; i < blocks.size(); ++i) {
        // Masses are relative to the light's: if nothing is learned they are exactly 1.
        const auto mass = mixed_masses(blocks[i], plain_masses(blocks[i], 1.0), share, scale);
        weights.push_back(powers[i] * mass[0]);
        add(blocks[i], mass);
    }
    lights_ = Cdf(weights);
}

void LearnedEmission::add(const EmissionBlocks& blocks, std::span<const double> mass) {
    const auto first = static_cast<std::uint32_t>(nodes_.size());
    roots_.push_back(first);
    // Uses the float32 probabilities by which warp() draws, so that densities agree exactly.
    std::vector<double> density(blocks.nodes.size(), 1.0);
    for (std::size_t i = 0; i < blocks.nodes.size(); ++i) {
        const EmissionBlocks::Node& node = blocks.nodes[i];
        if (node.axis < 0) {
            nodes_.push_back({static_cast<float>(1 / density[i]), -1, 0});  // > 0, as every share below is
            continue;
        }
        // Both halves have some of the plain density, so neither probability and neither density is 0.
        const auto lower =
            std::clamp(static_cast<float>(mass[node.child] / (mass[node.child] + mass[node.child + 1])),
                       0x1p-20F, 1 - 0x1p-20F);
        density[node.child] = 2 * density[i] * double{lower};
        density[node.child + 1] = 2 * density[i] * (1 - double{lower});
        nodes_.push_back({lower, node.axis, first + node.child});
    }
}

float LearnedEmission::warp(std::uint32_t light, LeSampleU& u) const {
    const Node* node = &nodes_[roots_[light]];
    if (node->axis < 0) return node->lower;
    const std::array<float*, 4> x = numbers(u);
    std::array<float, 4> low{}, width{1, 1, 1, 1};
    while (node->axis >= 0) {
        const auto axis = static_cast<std::size_t>(node->axis);
        float& at = *x[axis];
        const bool upper = !(at < node->lower);
        // Neither divisor is 0. For halves of equal probability both expressions are exact.
        at = upper ? (at - node->lower) / (1 - node->lower) : at / node->lower;
        at = std::min(at, kBelowOne);
        width[axis] *= 0.5F;
        if (upper) low[axis] += width[axis];
        node = &nodes_[node->child + (upper ? 1 : 0)];
    }
    for (std::size_t axis = 0; axis < 4; ++axis) {
        // Rounding must not carry a number into the next block.
        const float high = low[axis] + width[axis];  // exact, > 0
        const float below = std::bit_cast<float>(std::bit_cast<std::uint32_t>(high) - 1);
        *x[axis] = std::min(low[axis] + *x[axis] * width[axis], below);
    }
    return node->lower;
}

float LearnedEmission::density(std::uint32_t light, const LeSampleU& u) const {
    LeSampleU local = u;
    const std::array<float*, 4> x = numbers(local);
    const Node* node = &nodes_[roots_[light]];
    while (node->axis >= 0) {
        float& at = *x[static_cast<std::size_t>(node->axis)];
        const bool upper = !(at < 0.5F);
        at = upper ? 2 * at - 1 : 2 * at;  // exact
        node = &nodes_[node->child + (upper ? 1 : 0)];
    }
    return 1 / node->lower;
}

double LearnedEmission::probability(std::uint32_t light) const {
    return lights_.total() > 0 ? lights_.probability(light) : 0.0;
}

std::uint64_t LearnedEmission::hash() const {
    WordHash hash;
    for (std::size_t i = 0; i < lights_.size(); ++i) hash.add(lights_.probability(i));
    for (const Node& node : nodes_) {
        hash.add(node.lower);
        hash.add(int{node.axis});
        hash.add(std::uint64_t{node.child});
    }
    return hash.value();
}

}  // namespace lucerna
