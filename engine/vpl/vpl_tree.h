// Which lights of a million to ask: a tree of bounds over the blocks of a set, in which a place draws as many
// lights as it wants, in time that grows with the depth of the tree.
//
// A node bounds eight blocks or eight nodes, each by a sphere, a cone of normals and a sum of power; their
// importances for a place are worked out for all eight at once, and lights are drawn in proportion: down the
// nodes by importance, within a block by what each light would really send if nothing stood in between. All
// draws go down together: one number, stretched over all of them, says where each is, so that they spread
// over the lights as the importances do (systematic sampling).
//
// What lies where follows from the numbers alone, as in a BoxTree: the tree stores nothing but the
// bounds, 2.6 bytes for each light.
//
// Source: [Conty Estevez and Kulla 2018], with nodes of eight in place of two children, and without the
// splitting.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/vpl/vpl_contribution.h"

namespace lucerna {

// Bounds of eight; those that do not exist have no power.
struct alignas(32) VplNode8 {
    using Lane = std::array<float, kNodeWidth>;
    Lane x, y, z, r2;        // of the sphere: centre and squared radius, scene units
    Lane ax, ay, az, cos_o;  // of the cone: unit axis, cosine of its half angle
    Lane power;              // sums of estimates, the set's mean light as the unit
};

class VplTree {
  public:
    VplTree() = default;
    // Over the store's first set; questions come with the same store.
    VplTree(const VplStore& store, const Workers& workers);

    struct Drawn {
        std::uint32_t place;  // as VplStore has it
        float weight;         // the times it was drawn, over the times it would be on average; > 0
        float estimate;       // > 0
    };
    // Draws `draws` lights (at least 1); calls visit(Drawn) once for each that was drawn at least once. The
    // mean over u in [0,1) of the sum of weight · value is the sum of all lights' values. Fewer are drawn, or
    // none, where bounds gave importance to what no light contributes.
    template <typename Visit>
    void draw(const VplStore& store, const LightReceiver& at, std::uint32_t draws, double u,
              Visit&& visit) const;

    // Of one draw giving the light at `place`.
    double probability(const VplStore& store, const LightReceiver& at, std::uint32_t place) const;

    std::size_t bytes() const;

  private:
    using Importances = std::array<float, kNodeWidth>;
    static Importances importances(const VplNode8& node, const LightReceiver& at);
    bool in_medium(std::uint32_t block) const { return block >= range_.media; }

    VplRange range_;
    // Node i of level 0 is over the blocks from i·kNodeWidth, node i of a higher level over the nodes from
    // i·kNodeWidth of the level below. The highest level is one node; none over a single block.
    std::vector<std::vector<VplNode8>> levels_;
};

namespace vpl_tree {

// Draws first … end - 1 of all go to what covers [low, low + width) of the unit interval.
struct Part {
    double low, width;
    std::uint32_t index;
    std::uint32_t level;  // 0: a block, else one above its node's
    std::uint32_t first, end;
};

// A traversal of 2^32 lights is ten levels deep, and leaves at most seven parts behind on each.
inline constexpr std::size_t kMostParts = 80;

// Cuts a part by weights: calls visit(i, weight's share of all, low, first, end) for each weight that any
// draw falls on. Draw k stands at (k + u) / draws.
template <std::size_t N, typename Visit>
void cut(const Part& part, const std::array<float, N>& weights, double draws, double u, Visit&& visit) {
    double sum = 0;
    std::size_t last = N;
    for (std::size_t i = 0; i < N; ++i) {
        sum += static_cast<double>(weights[i]);
        if (weights[i] > 0) last = i;
    }
    if (last == N) return;  // nothing comes from here: what was drawn contributes 0
    const double per_weight = part.width / sum;
    double upto = part.low;
    std::uint32_t first = part.first;
    for (std::size_t i = 0; i <= last && first < part.end; ++i) {
        if (!(weights[i] > 0)) continue;
        const double low = upto, width = static_cast<double>(weights[i]) * per_weight;
        upto += width;
        // The last takes whatever rounding left over.
        const double before = std::ceil(upto * draws - u);  // draws below `upto`
        const auto first_d = static_cast<double>(first), end_d = static_cast<double>(part.end);
        const auto end =
            i == last ? part.end : static_cast<std::uint32_t>(std::clamp(before, first_d, end_d));
        if (end > first) visit(static_cast<std::uint32_t>(i), width, low, first, end);
        first = end;
    }
}

}  // namespace vpl_tree

template <typename Visit>
void VplTree::draw(const VplStore& store, const LightReceiver& at, std::uint32_t draws, double u,
                   Visit&& visit) const {
    using vpl_tree::Part;
    if (range_.end == range_.surfaces) return;
    std::array<Part, vpl_tree::kMostParts> parts;
    std::size_t size = 0;
    parts[size++] = {0, 1, 0, static_cast<std::uint32_t>(levels_.size()), 0, draws};
    const auto count = static_cast<double>(draws);
    while (size > 0) {
        const Part part = parts[--size];
        if (part.level == 0) {
            const std::uint32_t block = range_.surfaces + part.index;
            const ContributionEstimates estimate =
                estimate_contributions(store.blocks()[block], in_medium(block), at);
            vpl_tree::cut(
                part, estimate, count, u,
                [&](std::uint32_t lane, double width, double, std::uint32_t first, std::uint32_t end) {
                    const auto times = static_cast<double>(end - first);
                    visit(Drawn{static_cast<std::uint32_t>(block * kBlock + lane),
                                static_cast<float>(times / (count * width)), estimate[lane]});
                });
            continue;
        }
        const Importances child_importances = importances(levels_[part.level - 1][part.index], at);
        vpl_tree::cut(
            part, child_importances, count, u,
            [&](std::uint32_t child, double width, double low, std::uint32_t first, std::uint32_t end) {
                const std::uint32_t index = part.index * static_cast<std::uint32_t>(kNodeWidth) + child;
                if (part.level == 1) {
                    const auto* block = &store.blocks()[range_.surfaces + index];
                    for (std::size_t line = 0; line < sizeof(*block); line += 64) {
                        __builtin_prefetch(reinterpret_cast<const char*>(block) + line);
                    }
                }
                parts[size++] = {low, width, index, part.level - 1, first, end};
            });
    }
}

}  // namespace lucerna
