// Which light to ask, of many: by what each may send to the place that asks.
//
// A binary tree of bounds over the lights. A draw descends from its root, at every node to the child that
// is more important, in proportion; the probability of a light is the product along its way. Skies, which
// have no place, stand beside the tree: each is as probable as the tree as a whole. A light that can estimate
// what arrives from it (a measured lamp) is weighed by that instead of its bounds, in its leaf. A light of
// many parts (a mesh) has a leaf for each of them.
//
// Suns (lights of one direction, the same everywhere) are not chosen: whoever asks a light asks all of them
// as well. One shadow ray tells all about a sun, where the choice between it and the sky would be most of the
// noise of a sunlit place.
//
// Source: [Conty Estevez and Kulla 2018], without the splitting.
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
    static constexpr std::size_t kMostSuns = 4;  // where there are more, one is chosen as of other lights

    // Lights without power, and those that only particles carry, are left out. The lights must live on.
    explicit LightTree(std::span<const std::unique_ptr<Light>> lights);

    struct Pick {
        std::uint32_t light;
        CellId part;        // kNoCell: the light as a whole
        float probability;  // > 0
    };
    // For a point x with normal n on the side seen, if it is of an opaque surface; or 0. None: no light can
    // send anything there. u in [0,1).
    std::optional<Pick> pick(const V3f& x, const V3f& n, float u) const;
    // Of pick() giving this light and part; `part` is of no matter where the light is picked as a whole.
    float probability(const V3f& x, const V3f& n, std::uint32_t light, CellId part = kNoCell) const;
    bool picks_parts_of(std::uint32_t light) const { return positions_[light].parts > 1; }

    // Those that pick() never gives, each to be asked beside what it gives.
    std::span<const std::uint32_t> suns() const { return suns_; }

    // Parts count for one each.
    std::size_t lights_in_tree() const { return (nodes_.size() + 1) / 2; }

  private:
    struct Node {
        LightImportance importance;
        std::uint32_t next;  // inner: the second child, the first follows at once; leaf: the light
        CellId part;
        bool leaf;
    };
    // How a light is reached.
    struct Position {
        bool known = false;       // among the lights that are chosen at all
        bool placed = false;      // in the tree
        std::uint32_t parts = 1;  // leaves of their own
        std::uint32_t first = 0;  // of their turns
    };
    struct Building;
    float importance(const Node& node, const V3f& x, const V3f& n) const;
    float first_child_probability(std::uint32_t node, const V3f& x, const V3f& n) const;
    // Of going down the tree rather than to any one of those beside it.
    float tree_share() const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> beside_;  // lights without a place
    std::vector<std::uint32_t> suns_;
    std::vector<Position> positions_;   // by light
    std::vector<std::uint64_t> turns_;  // to each leaf from the root: bit i set, the second child at depth i
    std::vector<const Light*> estimating_;  // by light: itself, if it estimates what arrives; or null
};

// Which light to ask: one of many, in proportion to power.
class LightPicker {
  public:
    LightPicker() = default;
    explicit LightPicker(std::span<const std::unique_ptr<Light>> lights);

    struct Pick {
        std::uint32_t light;
        float probability;  // > 0
        float remainder;    // of u, uniform in [0,1) again
    };
    // None if no light has power. u in [0,1).
    std::optional<Pick> pick(float u) const { return pick(cdf_, u); }
    // The same by other weights of the lights than their power.
    static std::optional<Pick> pick(const Cdf& lights, float u);
    float probability(std::uint32_t light) const;
    double total_power() const { return cdf_.total(); }  // W

  private:
    Cdf cdf_;
};

}  // namespace lucerna
