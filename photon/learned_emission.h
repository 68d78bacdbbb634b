// Emission where it matters: which lights to ask, and with which numbers, so that more light paths end where
// the picture needs them.
//
// Plain emission is a function of five uniform numbers: one chooses the light by its power, four go to that
// light (LeSampleU), which makes a particle of them. Learned emission changes the density of those numbers
// and nothing else. It knows a share for every light, and for each light a partition of the unit hypercube of
// its four numbers into blocks, each half of the one it was cut from; within a block the numbers stay
// uniform.
//
// Why the numbers and not the lamp's cells. A measured lamp inverts its four numbers, one after the other,
// into the interval of S and the pixel of M from which a particle leaves (cell_table.h): every set of cells
// that is a box in that order is a box of numbers, and equal volumes of numbers are equal shares of the
// lamp's flux, whatever the lamp's resolution. So blocks of numbers *are* blocks of cells, already of even
// flux, and cut through cells where light must be told apart more finely. The same blocks steer every other
// light (the sky's texels, the directions of a photometric web, the places of an area light) without the
// light having to know of it.
//
// Unbiased. Let p be the plain density of (light, numbers) and q the learned one. A path drawn from q has its
// power multiplied by p/q, so what is estimated is the integral of f q p/q = f p wherever q > 0; and q >= β p
// everywhere, β the defensive weight, so it is, and no weight exceeds 1/β. It must not be learned from the
// paths that it weighs: a pre-pass's are those of no pass (importance_pre_pass.h).
//
// A draw descends the light's blocks, at most EmissionBlocks::kMostCuts of them whatever the lamp, and
// stretches one number at each: a monotone map of each number within its block. So what is stratified stays
// so ([Clarberg 2005] warps points down a hierarchy in this way), and a
// density whose defensive weight is 1 changes no bit of any number.
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

// A light's blocks and their importance: what a learned density is made of. nodes[0] is the whole hypercube.
struct EmissionBlocks {
    // A block is cut at most so often along one axis, so that each of its numbers keeps 12 bits of 24 of its
    // own, and in all.
    static constexpr int kMostCutsOfAxis = 12, kMostCuts = 24;

    struct Node {
        int axis = -1;            // of position.x, position.y, direction.x, direction.y; -1: not cut
        std::uint32_t child = 0;  // the lower half; the upper one follows. Larger than the node's own index
        double importance =
            0;  // of an undivided block: how often to draw there, per plain draw; >= 0, finite
    };
    std::vector<Node> nodes{Node{}};
};

class LearnedEmission {
  public:
    // Mixes the density of `blocks`, one for each of the scene's lights, with emission by power, whose share
    // is kDefensiveWeight. If nothing is important, this is emission by power.
    LearnedEmission(const Scene& scene, std::span<const EmissionBlocks> blocks);

    // None if no light has power. u in [0,1).
    std::optional<LightPicker::Pick> pick(float u) const { return LightPicker::pick(lights_, u); }

    // Moves the numbers of a picked light to where the learned density has them; returns p/q of the light's
    // own numbers: what its particle's power is to be multiplied by.
    float warp(std::uint32_t light, LeSampleU& u) const;

    // q/p of the light's own numbers, at `u`.
    float density(std::uint32_t light, const LeSampleU& u) const;
    // With which the light is picked.
    double probability(std::uint32_t light) const;

    std::size_t blocks() const { return (nodes_.size() + roots_.size()) / 2; }  // of all lights
    // Names the density.
    std::uint64_t hash() const;

  private:
    struct Node {
        float lower;  // share of the lower half; of an undivided block p/q
        std::int32_t axis;
        std::uint32_t child;  // index in nodes_
    };
    void add(const EmissionBlocks& blocks, std::span<const double> mass);

    Cdf lights_;                        // power times the light's q/p
    std::vector<std::uint32_t> roots_;  // of each light's nodes
    std::vector<Node> nodes_;           // all lights' blocks
};

}  // namespace lucerna
