// Learned emission chooses lights, and the random numbers of their particles, so that more light paths end
// where the image needs them.
//
// Plain emission is a function of five uniform numbers: one chooses the light by its power, and four
// (LeSampleU, beside a number of the path) are passed to that light, which generates a particle from them.
// Learned emission changes the density of those numbers and nothing else. It has a probability for each
// light, and for each light a partition of the unit hypercube of its four numbers into blocks, made by
// successive halving; within a block the numbers stay uniform.
//
// Blocks divide the numbers, not the cells of a lamp. A measured lamp inverts its four numbers, one after the
// other, into the interval of S and the pixel of M from which a particle leaves (cell_table.h). A set of
// cells that is a box in that order is therefore a box of numbers, and equal volumes of numbers carry equal
// shares of the lamp's flux, whatever its resolution. Blocks of numbers thus *are* blocks of cells, already
// of equal flux, and can divide a cell where light must be resolved more finely. The same blocks guide every
// other light (texels of the sky, directions of a photometric web, positions on an area light) without any
// support by the light.
//
// The estimate is unbiased. Let p be the plain density of (light, numbers) and q the learned one. A path
// drawn from q has its power multiplied by p/q, so that the estimate is the integral of f q p/q = f p
// wherever q > 0. This holds everywhere, since q >= β p with β the defensive weight, and no weight exceeds
// 1/β. The density must not be learned from the paths that it weights: a pre-pass uses paths of no pass
// (importance_pre_pass.h).
//
// A draw descends at most EmissionBlocks::kMostCuts levels of the light's blocks, whatever the lamp, and
// stretches one number at each: a monotone map of each number within its block. This preserves stratification
// ([Clarberg 2005] warps points down a hierarchy in this way), and a density whose defensive weight is 1
// changes no bit of any number.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/sampler.h"
#include "engine/scene/scene.h"
#include "lights/light.h"
#include "lights/light_tree.h"

namespace lucerna {

// The blocks of a light and their importance, from which a learned density is made. nodes[0] is the whole
// hypercube.
struct EmissionBlocks {
    // Largest number of cuts along one axis, which leaves each number 12 of its 24 bits within a block, and
    // in total.
    static constexpr int kMostCutsOfAxis = 12, kMostCuts = 24;

    struct Node {
        int axis = -1;            // of position.x, position.y, direction.x, direction.y; -1: not cut
        std::uint32_t child = 0;  // the lower half; the upper one follows. Larger than the node's own index
        double importance = 0;    // of a leaf: draws per plain draw; >= 0, finite
    };
    std::vector<Node> nodes{Node{}};
};

class LearnedEmission {
  public:
    // Mixes the density of `blocks`, one for each of the scene's lights, with emission by power of weight
    // kDefensiveWeight. If no block has importance, this is emission by power.
    LearnedEmission(const Scene& scene, std::span<const EmissionBlocks> blocks);

    // Picks a light; none if no light has power. u in [0,1).
    std::optional<LightPicker::Pick> pick(float u) const { return LightPicker::pick(lights_, u); }

    // Warps the numbers of a picked light to the learned density. Returns p/q of the light's own numbers, by
    // which the power of its particle must be multiplied.
    float warp(std::uint32_t light, LeSampleU& u) const;

    // Returns q/p of the light's own numbers, at `u`.
    float density(std::uint32_t light, const LeSampleU& u) const;
    // Returns the probability with which the light is picked.
    double probability(std::uint32_t light) const;

    std::size_t blocks() const { return (nodes_.size() + roots_.size()) / 2; }  // of all lights
    // Identifies the density.
    std::uint64_t hash() const;

  private:
    struct Node {
        float lower;  // probability of the lower half; in a leaf p/q
        std::int32_t axis;
        std::uint32_t child;  // index in nodes_
    };
    void add(const EmissionBlocks& blocks, std::span<const double> mass);

    Cdf lights_;                        // power times the light's q/p
    std::vector<std::uint32_t> roots_;  // by light: index in nodes_
    std::vector<Node> nodes_;           // all lights' blocks
};

}  // namespace lucerna
