#include "lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/elementary.h"
#include "engine/base/error.h"

namespace lucerna {
namespace {

constexpr int kBuckets = 12;
constexpr int kDeepest = 60;  // the turns of a path fit 64 bits; splits near this depth are by halves

V3f middle(const Box3f& box) {
    return 0.5F * (box.min + box.max);
}

// Returns the solid angle over which the lights of a bound shine, weighted as in [Conty Estevez and Kulla
// 2018, (1)].
double orientation_measure(const LightBounds& b) {
    const double o = double{b.theta_o};
    const double w = std::min(o + double{b.theta_e}, kPiD);
    return 2 * kPiD * (1 - cos(o)) + kPiD / 2 * (2 * w * sin(o) - cos(o - 2 * w) - 2 * o * sin(o) + cos(o));
}

// Returns half the surface area; a flat or point-like box is widened, so that its power counts.
double area_measure(const Box3f& box, float least_side) {
    const V3d d(box.size());
    const double x = std::max(d.x, double{least_side}), y = std::max(d.y, double{least_side}),
                 z = std::max(d.z, double{least_side});
    return x * y + y * z + z * x;
}

}  // namespace

struct LightTree::Building {
    struct Item {
        LightBounds bounds;
        std::uint32_t light;
        CellId part;
    };
    LightTree& tree;
    std::vector<Item> items;
    float least_side = 0;  // minimum side of a box in the cost

    // Lays out the nodes with the first child directly behind its parent. Returns the bounds of all items.
    LightBounds build(std::size_t begin, std::size_t end, std::uint64_t turns, int depth) {
        const auto at = tree.nodes_.size();
        if (end - begin == 1) {
            const Item& item = items[begin];
            tree.nodes_.push_back({LightImportance(item.bounds), item.light, item.part, true});
            const std::uint32_t part = item.part == kNoCell ? 0 : item.part;
            tree.turns_[tree.positions_[item.light].first + part] = turns;
            return item.bounds;
        }
        const std::size_t middle_item = split(begin, end, depth);
        tree.nodes_.push_back({});
        const LightBounds first = build(begin, middle_item, turns, depth + 1);
        const auto next = static_cast<std::uint32_t>(tree.nodes_.size());
        const LightBounds second = build(middle_item, end, turns | std::uint64_t{1} << depth, depth + 1);
        const LightBounds all = union_of(first, second);
        tree.nodes_[at] = {LightImportance(all), next, kNoCell, false};
        return all;
    }

    double cost(const LightBounds& b) const {
        return double{b.power} * orientation_measure(b) * area_measure(b.box, least_side);
    }

    // Cuts the longest axis of the boxes' centres where the sum of the two costs is least [Conty Estevez and
    // Kulla 2018, 4.2].
    std::size_t split(std::size_t begin, std::size_t end, int depth) {
        const std::size_t half = begin + (end - begin) / 2;
        Box3f centres;
        for (std::size_t i = begin; i < end; ++i) centres.extendBy(middle(items[i].bounds.box));
        const unsigned axis = centres.majorAxis();
        const float from = centres.min[axis], width = centres.max[axis] - from;
        if (!(width > 0)) return half;  // all centres coincide
        const auto place = [&](const Item& item) { return middle(item.bounds.box)[axis]; };
        const auto bucket = [&](const Item& item) {
            return std::min(static_cast<int>(kBuckets * ((place(item) - from) / width)), kBuckets - 1);
        };
        // Deep in the tree, splits by halves limit the depth: 2^31 lights need only 31 more levels.
        if (depth < kDeepest - 32) {
            const int cut = cheapest_cut(begin, end, bucket);
            const auto found = std::stable_partition(items.begin() + static_cast<std::ptrdiff_t>(begin),
                                                     items.begin() + static_cast<std::ptrdiff_t>(end),
                                                     [&](const Item& item) { return bucket(item) <= cut; });
            const auto middle_item = static_cast<std::size_t>(found - items.begin());
            if (middle_item > begin && middle_item < end) return middle_item;
        }
        std::stable_sort(items.begin() + static_cast<std::ptrdiff_t>(begin),
                         items.begin() + static_cast<std::ptrdiff_t>(end),
                         [&](const Item& a, const Item& b) { return place(a) < place(b); });
        return half;
    }

    template <typename Bucket>
    int cheapest_cut(std::size_t begin, std::size_t end, Bucket&& bucket) const {
        std::array<std::optional<LightBounds>, kBuckets> in;
        const auto add = [](std::optional<LightBounds>& to, const LightBounds& more) {
            to = to ? union_of(*to, more) : more;
        };
        for (std::size_t i = begin; i < end; ++i) {
            add(in[static_cast<std::size_t>(bucket(items[i]))], items[i].bounds);
        }
        int best = 0;
        double least = INFINITY;
        for (int cut = 0; cut + 1 < kBuckets; ++cut) {
            std::optional<LightBounds> low, high;
            for (int b = 0; b < kBuckets; ++b) {
                const auto& bounds = in[static_cast<std::size_t>(b)];
                if (bounds) add(b <= cut ? low : high, *bounds);
            }
            if (!low || !high) continue;
            const double sum = cost(*low) + cost(*high);
            if (sum < least) least = sum, best = cut;
        }
        return best;
    }
};

LightTree::LightTree(std::span<const std::unique_ptr<Light>> lights)
    : positions_(lights.size()), estimating_(lights.size()) {
    Building building{*this, {}, 0};
    double total = 0;
    for (const auto& light : lights) total += light->only_particles() ? 0.0 : light->power();
    Box3f all;
    for (std::uint32_t i = 0; i < lights.size(); ++i) {
        const Light& light = *lights[i];
        if (light.only_particles() || !(light.power() > 0)) continue;
        auto bounds = light.bounds();
        if (!bounds) {
            (light.is_delta() ? suns_ : beside_).push_back(i);
            continue;
        }
        // Powers are relative to the total, so that neither tiny nor huge ones leave the range of float32;
        // the minimum keeps every light.
        const auto share = [&](double of_light) {
            return std::max(static_cast<float>(of_light * light.power() / total), 1e-30F);
        };
        all.extendBy(bounds->box);
        const auto parts = light.part_bounds();
        const auto first = static_cast<std::uint32_t>(turns_.size());
        positions_[i] = {true, true, std::max(1U, static_cast<std::uint32_t>(parts.size())), first};
        turns_.resize(turns_.size() + positions_[i].parts);
        for (CellId part = 0; part < parts.size(); ++part) {
            LightBounds one = parts[part];
            one.power = share(double{one.power});
            building.items.push_back({one, i, part});
        }
        if (!parts.empty()) continue;
        bounds->power = share(1);
        if (light.arriving(middle(bounds->box))) estimating_[i] = &light;
        building.items.push_back({*bounds, i, kNoCell});
    }
    if (suns_.size() > kMostSuns) {
        beside_.insert(beside_.end(), suns_.begin(), suns_.end());
        suns_.clear();
    }
    for (const std::uint32_t i : beside_) positions_[i].known = true;
    if (building.items.empty()) return;
    building.least_side = 1e-4F * all.size().length();
    nodes_.reserve(2 * building.items.size());
    building.build(0, building.items.size(), 0, 0);
}

float LightTree::tree_share() const {
    return nodes_.empty() ? 0.0F : 1.0F / static_cast<float>(beside_.size() + 1);
}

float LightTree::importance(const Node& node, const V3f& x, const V3f& n) const {
    const Light* const light = node.leaf ? estimating_[node.next] : nullptr;
    if (light == nullptr) return node.importance.at(x, n);
    return node.importance.at(x, n, *light->arriving(x));
}

float LightTree::first_child_probability(std::uint32_t node, const V3f& x, const V3f& n) const {
    const float first = importance(nodes_[node + 1], x, n);
    const float second = importance(nodes_[nodes_[node].next], x, n);
    // If both are 0, neither can send anything, as -1 indicates. The sum does not overflow, because the
    // powers are shares of the total, and divisors are at least 1e-30.
    return first + second > 0 ? first / (first + second) : -1.0F;
}

std::optional<LightTree::Pick> LightTree::pick(const V3f& x, const V3f& n, float u) const {
    const float down = tree_share();
    if (!(u < down)) {
        if (beside_.empty()) return std::nullopt;
        const float rest = (u - down) / (1 - down);  // beside_ is not empty, so down < 1
        const auto count = static_cast<float>(beside_.size());
        const auto i = std::min(static_cast<std::size_t>(rest * count), beside_.size() - 1);
        return Pick{beside_[i], kNoCell, (1 - down) / count};
    }
    u = std::min(u / down, kBelowOne);
    float probability = down;
    std::uint32_t node = 0;
    if (nodes_[0].leaf && !(importance(nodes_[0], x, n) > 0)) return std::nullopt;
    while (!nodes_[node].leaf) {
        const float p = first_child_probability(node, x, n);
        if (p < 0) return std::nullopt;
        const bool first = u < p;
        u = std::min(first ? u / p : (u - p) / (1 - p), kBelowOne);
        probability *= first ? p : 1 - p;
        node = first ? node + 1 : nodes_[node].next;
    }
    if (!(probability > 0)) return std::nullopt;
    return Pick{nodes_[node].next, nodes_[node].part, probability};
}

float LightTree::probability(const V3f& x, const V3f& n, std::uint32_t light, CellId part) const {
    const Position& position = positions_[light];
    if (!position.known) return 0;
    const float down = tree_share();
    if (!position.placed) return (1 - down) / static_cast<float>(beside_.size());
    float probability = down;
    if (nodes_[0].leaf) return importance(nodes_[0], x, n) > 0 ? probability : 0.0F;
    assert(position.parts == 1 || part < position.parts);
    const std::uint64_t turns = turns_[position.first + (position.parts > 1 ? part : 0)];
    std::uint32_t node = 0;
    for (int depth = 0; !nodes_[node].leaf; ++depth) {
        const float p = first_child_probability(node, x, n);
        if (p < 0) return 0;
        const bool second = (turns >> depth & 1) != 0;
        probability *= second ? 1 - p : p;
        node = second ? nodes_[node].next : node + 1;
    }
    return probability;
}

LightPicker::LightPicker(std::span<const std::unique_ptr<Light>> lights) {
    std::vector<double> powers;
    powers.reserve(lights.size());
    for (const auto& light : lights) {
        const double power = light->power();
        if (!std::isfinite(power) || power < 0) {
            throw InputError(
                fmt::format("light {} ({}): its power is {} W; expected a finite number, not negative",
                            powers.size(), light->kind(), power));
        }
        powers.push_back(power);
    }
    cdf_ = Cdf(powers);
}

std::optional<LightPicker::Pick> LightPicker::pick(const Cdf& lights, float u) {
    if (!(lights.total() > 0)) return std::nullopt;
    const Cdf::Draw draw = lights.draw(u);
    // A light too weak beside the others would have probability 0 in float32, so it is not picked.
    const auto probability = static_cast<float>(draw.probability);
    if (!(probability > 0)) return std::nullopt;
    return Pick{static_cast<std::uint32_t>(draw.item), probability, draw.remainder};
}

float LightPicker::probability(std::uint32_t light) const {
    return cdf_.total() > 0 ? static_cast<float>(cdf_.probability(light)) : 0.0F;
}

}  // namespace lucerna
