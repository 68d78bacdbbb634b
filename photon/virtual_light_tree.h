// Which lights of a million to ask: a tree of bounds over the blocks of a set, in which a place draws as many
// lights as it wants, in time that grows with the depth of the tree.
//
// A fan bounds eight blocks or eight fans, each by a sphere, a cone of normals and a sum of power; what they
// promise to a place is worked out for all eight at once, and lights are drawn in proportion: down the fans
// by promise, within a block by what each light would really send if nothing stood in between. All draws go
// down together: one number, stretched over all of them, says where each is, so that they spread over the
// lights as the promises do (systematic sampling).
//
// What lies where follows from the numbers alone, as in a BoxTree: the tree stores nothing but the
// bounds, 2.6 bytes for each light.
//
// Source: Conty Estevez and Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting", 2018
// [CK18], with fans of eight in place of two children, and without the splitting.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/base/parallel.h"
#include "photon/virtual_light_worth.h"

namespace lucerna {

// Bounds of eight; those that do not exist have no power.
struct alignas(32) VirtualLightFan {
    using Lane = std::array<float, kFan>;
    Lane x, y, z, r2;        // of the sphere: centre and squared radius, scene units
    Lane ax, ay, az, cos_o;  // of the cone: unit axis, cosine of its half angle
    Lane power;              // sums of worth, the set's mean light as the unit
};

class VirtualLightTree {
  public:
    VirtualLightTree() = default;
    // Over the store's first set; questions come with the same store.
    VirtualLightTree(const VirtualLightStore& store, const Workers& workers);

    struct Drawn {
        std::uint32_t place;  // as VirtualLightStore has it
        float weight;         // the times it was drawn, over the times it would be on average; > 0
        float worth;          // > 0
    };
    // Draws `draws` lights (at least 1); calls take(Drawn) once for each that was drawn at least once. The
    // mean over u in [0,1) of the sum of weight · value is the sum of all lights' values. Fewer are drawn, or
    // none, where bounds promised what no light keeps.
    template <typename Take>
    void draw(const VirtualLightStore& store, const LightReceiver& at, std::uint32_t draws, double u,
              Take&& take) const;

    // Of one draw giving the light at `place`.
    double probability(const VirtualLightStore& store, const LightReceiver& at, std::uint32_t place) const;

    std::size_t bytes() const;

  private:
    using Promises = std::array<float, kFan>;
    static Promises promises(const VirtualLightFan& fan, const LightReceiver& at);
    bool in_medium(std::uint32_t block) const { return block >= range_.media; }

    VirtualLightRange range_;
    // Fan i of level 0 is over the blocks from i·kFan, fan i of a higher level over the fans from i·kFan of
    // the level below. The highest level is one fan; none over a single block.
    std::vector<std::vector<VirtualLightFan>> levels_;
};

namespace virtual_light_tree {

// Draws first … end - 1 of all go to what covers [low, low + width) of the unit interval.
struct Part {
    double low, width;
    std::uint32_t index;
    std::uint32_t level;  // 0: a block, else one above its fan's
    std::uint32_t first, end;
};

// A walk through 2^32 lights is ten levels deep, and leaves at most seven parts behind on each.
inline constexpr std::size_t kMostParts = 80;

// Cuts a part by weights: calls take(i, weight's share of all, low, first, end) for each weight that any draw
// falls on. Draw k stands at (k + u) / draws.
template <std::size_t N, typename Take>
void cut(const Part& part, const std::array<float, N>& weights, double draws, double u, Take&& take) {
    double sum = 0;
    std::size_t last = N;
    for (std::size_t i = 0; i < N; ++i) {
        sum += static_cast<double>(weights[i]);
        if (weights[i] > 0) last = i;
    }
    if (last == N) return;  // nothing comes from here: what was drawn is worth 0
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
        if (end > first) take(static_cast<std::uint32_t>(i), width, low, first, end);
        first = end;
    }
}

}  // namespace virtual_light_tree

template <typename Take>
void VirtualLightTree::draw(const VirtualLightStore& store, const LightReceiver& at, std::uint32_t draws,
                            double u, Take&& take) const {
    using virtual_light_tree::Part;
    if (range_.end == range_.surfaces) return;
    std::array<Part, virtual_light_tree::kMostParts> parts;
    std::size_t size = 0;
    parts[size++] = {0, 1, 0, static_cast<std::uint32_t>(levels_.size()), 0, draws};
    const auto count = static_cast<double>(draws);
    while (size > 0) {
        const Part part = parts[--size];
        if (part.level == 0) {
            const std::uint32_t block = range_.surfaces + part.index;
            const Worths worth = worths(store.blocks()[block], in_medium(block), at);
            virtual_light_tree::cut(
                part, worth, count, u,
                [&](std::uint32_t lane, double width, double, std::uint32_t first, std::uint32_t end) {
                    const auto times = static_cast<double>(end - first);
                    take(Drawn{static_cast<std::uint32_t>(block * kBlock + lane),
                               static_cast<float>(times / (count * width)), worth[lane]});
                });
            continue;
        }
        const Promises promised = promises(levels_[part.level - 1][part.index], at);
        virtual_light_tree::cut(
            part, promised, count, u,
            [&](std::uint32_t child, double width, double low, std::uint32_t first, std::uint32_t end) {
                const std::uint32_t index = part.index * static_cast<std::uint32_t>(kFan) + child;
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
