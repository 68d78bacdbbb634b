// Chooses one of many lights by how much each may send to the shading point.
//
// LightTree is a binary tree of bounds over the lights. A draw descends from the root and chooses between two
// children in proportion to their importance; the probability of a light is the product along its path.
// Skies, which have no place, stand beside the tree, and each is as probable as the whole tree. In its leaf,
// a light that can estimate what arrives from it (a measured lamp) is weighted by that estimate instead of
// its bounds. A light of many parts (a mesh) has a leaf for each of them.
//
// Suns (distant lights, whose light is the same everywhere) are not chosen: the caller samples all of them in
// addition to the chosen light. One shadow ray resolves a sun completely, whereas a random choice between it
// and the sky would cause most of the noise of a sunlit place.
//
// Source: [Conty Estevez and Kulla 2018], without their splitting.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/sampler.h"
#include "lights/light.h"
#include "lights/light_bounds.h"

namespace lucerna {

class LightTree {
  public:
    LightTree() = default;
    static constexpr std::size_t kMostSuns = 4;  // if there are more, they are chosen like other lights

    // Leaves out lights without power and those that only particles carry. The lights must outlive the tree.
    explicit LightTree(std::span<const std::unique_ptr<Light>> lights);

    struct Pick {
        std::uint32_t light;
        CellId part;        // kNoCell: the light as a whole
        float probability;  // > 0
    };
    // Chooses a light for a point x. n is the normal on the side seen if x lies on an opaque surface, or 0. u
    // is in [0,1). Returns none if no light can send anything to x.
    std::optional<Pick> pick(const V3f& x, const V3f& n, float u) const;
    // Returns the probability that pick() gives this light and part. A light picked as a whole ignores
    // `part`.
    float probability(const V3f& x, const V3f& n, std::uint32_t light, CellId part = kNoCell) const;
    bool picks_parts_of(std::uint32_t light) const { return positions_[light].parts > 1; }

    // Returns the lights that pick() never gives and that the caller samples in addition.
    std::span<const std::uint32_t> suns() const { return suns_; }

    // Counts each part as one light.
    std::size_t lights_in_tree() const { return (nodes_.size() + 1) / 2; }

  private:
    struct Node {
        LightImportance importance;
        std::uint32_t next;  // of an inner node, the second child (the first one follows directly); of a
                             // leaf, the light
        CellId part;
        bool leaf;
    };
    // Locates a light in the tree.
    struct Position {
        bool known = false;       // it can be chosen at all
        bool placed = false;      // it is in the tree
        std::uint32_t parts = 1;  // number of leaves
        std::uint32_t first = 0;  // index of its first entry in turns_
    };
    struct Building;
    float importance(const Node& node, const V3f& x, const V3f& n) const;
    float first_child_probability(std::uint32_t node, const V3f& x, const V3f& n) const;
    // Returns the probability of descending the tree rather than choosing one of beside_.
    float tree_share() const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> beside_;  // lights without a place
    std::vector<std::uint32_t> suns_;
    std::vector<Position> positions_;   // one per light
    std::vector<std::uint64_t> turns_;  // the path to each leaf: bit i is set for a second child at depth i
    std::vector<const Light*> estimating_;  // per light: itself if it estimates what arrives, or null
};

// Chooses one of many lights in proportion to power.
class LightPicker {
  public:
    LightPicker() = default;
    explicit LightPicker(std::span<const std::unique_ptr<Light>> lights);

    struct Pick {
        std::uint32_t light;
        float probability;  // > 0
        float remainder;    // of u, uniform in [0,1) again
    };
    // Returns none if no light has power. u is in [0,1).
    std::optional<Pick> pick(float u) const { return pick(cdf_, u); }
    // As above, with other weights of the lights than their power.
    static std::optional<Pick> pick(const Cdf& lights, float u);
    float probability(std::uint32_t light) const;
    double total_power() const { return cdf_.total(); }  // W

  private:
    Cdf cdf_;
};

}  // namespace lucerna
