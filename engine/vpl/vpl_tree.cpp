#include "engine/vpl/vpl_tree.h"

#include <span>

#include "lights/light_bounds.h"

namespace lucerna {
namespace {

// Light scattered in a medium goes everywhere: its importance is computed with an even phase function. What
// peaks is seen to within blocks.
constexpr float kEvenPhase = 0.25F * kInvPi;

LightBounds bounds_of(const VplBlock& block, bool in_medium, float unit) {
    std::array<LightBounds, kBlock> all;
    std::size_t size = 0;
    for (std::size_t i = 0; i < kBlock; ++i) {
        const float power = luminance({block.r[i], block.g[i], block.b[i]}) * unit;
        if (!(power > 0)) continue;
        LightBounds one;
        one.box.extendBy(V3f(block.x[i], block.y[i], block.z[i]));
        one.power = in_medium ? power * kEvenPhase : power;
        if (!in_medium) {
            one.axis = {block.nx[i], block.ny[i], block.nz[i]};
            one.theta_o = 0;
        }
        all[size++] = one;
    }
    if (size == 0) return {};
    return union_of(std::span(all).first(size));
}

void put(const LightBounds& bounds, VplNode8& node, std::size_t i) {
    const V3f centre = 0.5F * (bounds.box.min + bounds.box.max);
    node.x[i] = centre.x, node.y[i] = centre.y, node.z[i] = centre.z;
    // The corners' distance, rounded up.
    node.r2[i] = 0.25F * bounds.box.size().length2() * (1 + 1e-5F);
    node.ax[i] = bounds.axis.x, node.ay[i] = bounds.axis.y, node.az[i] = bounds.axis.z;
    node.cos_o[i] = bounds.theta_o >= kPi ? -1.0F : std::cos(bounds.theta_o);
    node.power[i] = bounds.power;
}

// The level over what is bounded, and in its place the bounds of the level.
std::vector<VplNode8> level_over(std::vector<LightBounds>& bounded, const Workers& workers) {
    const std::size_t nodes = (bounded.size() + kNodeWidth - 1) / kNodeWidth;
    std::vector<VplNode8> level(nodes);
    std::vector<LightBounds> bounds(nodes);
    constexpr std::int64_t kGrain = 1 << 10;
    parallel_each(workers, nodes, kGrain, [&](std::size_t f) {
        const std::size_t first = f * kNodeWidth;
        const std::size_t size = std::min(kNodeWidth, bounded.size() - first);
        level[f] = {};
        const auto under = std::span(bounded).subspan(first, size);
        for (std::size_t i = 0; i < size; ++i) put(under[i], level[f], i);
        bounds[f] = union_of(under);
    });
    bounded.swap(bounds);
    return level;
}

}  // namespace

VplTree::VplTree(const VplStore& store, const Workers& workers)
    : range_(store.sets() > 0 ? store.range(0) : VplRange{}) {
    const std::size_t blocks = range_.end - range_.surfaces;
    std::vector<LightBounds> bounded(blocks);
    constexpr std::int64_t kGrain = 1 << 10;
    parallel_each(workers, blocks, kGrain, [&](std::size_t i) {
        const auto block = range_.surfaces + static_cast<std::uint32_t>(i);
        bounded[i] = bounds_of(store.blocks()[block], in_medium(block), store.unit());
    });
    while (bounded.size() > 1) levels_.push_back(level_over(bounded, workers));
}

VplTree::Importances VplTree::importances(const VplNode8& node, const LightReceiver& at) {
    const bool medium = at.kind == LightReceiver::Kind::medium;
    const float min2 = at.mindist * at.mindist;
    const float nearest2 = std::max(0.8F * min2, 1e-30F), dark2 = 0.79F * min2;
    Importances result;
    for (std::size_t i = 0; i < kNodeWidth; ++i) {
        const float dx = node.x[i] - at.x.x, dy = node.y[i] - at.x.y, dz = node.z[i] - at.x.z;
        const float d2 = dx * dx + dy * dy + dz * dz;
        const float inv_d = 1 / std::sqrt(std::max(d2, 1e-30F));
        const light_importance::Filled filled(d2, node.r2[i]);
        // What is sent: a cosine, at most that to the nearest normal.
        const float along = (node.ax[i] * dx + node.ay[i] * dy + node.az[i] * dz) * inv_d;
        const float cos_w = std::min(std::max(-along, -1.0F), 1.0F);
        const float cos_o = node.cos_o[i];
        float value = light_importance::shining(filled, cos_w, cos_o, light_importance::sine(cos_o), 0.0F);
        // What is made of it.
        const V3f& n = medium ? at.wo : at.ng;
        const float cosine = std::min(std::max((n.x * dx + n.y * dy + n.z * dz) * inv_d, -1.0F), 1.0F);
        const float toward =
            at.phase_g < 0 ? cosine : -cosine;  // a peak ahead scatters what comes against wo
        const float phase = contribution_detail::phase(std::fabs(at.phase_g), filled.cos_of_rest(toward));
        const float received = at.through ? 1.0F : light_importance::receiving(filled, cosine);
        value *= medium ? phase : received;
        // Nearer than the fade nothing lights; a place within the sphere is as near as its rim, for all that
        // is known.
        value *= node.power[i] / std::max(std::max(d2, node.r2[i]), nearest2);
        const float farthest = std::sqrt(d2) + std::sqrt(node.r2[i]);
        result[i] = farthest * farthest < dark2 ? 0.0F : value;
    }
    return result;
}

double VplTree::probability(const VplStore& store, const LightReceiver& at, std::uint32_t place) const {
    const auto share = [](const auto& weights, std::size_t i) {
        double sum = 0;
        for (const float w : weights) sum += static_cast<double>(w);
        return sum > 0 ? static_cast<double>(weights[i]) / sum : 0.0;
    };
    const auto block = static_cast<std::uint32_t>(place / kBlock);
    const std::uint32_t index = block - range_.surfaces;
    double probability = 1;
    for (std::size_t level = levels_.size(); level > 0; --level) {
        const std::uint32_t child = index >> (3 * (level - 1));
        probability *= share(importances(levels_[level - 1][child / kNodeWidth], at), child % kNodeWidth);
    }
    return probability *
           share(estimate_contributions(store.blocks()[block], in_medium(block), at), place % kBlock);
}

std::size_t VplTree::bytes() const {
    std::size_t sum = 0;
    for (const auto& level : levels_) sum += level.size() * sizeof(VplNode8);
    return sum;
}

}  // namespace lucerna
