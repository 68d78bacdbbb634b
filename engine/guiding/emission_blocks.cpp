#include "engine/guiding/importance_pre_pass.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <optional>
#include <queue>

namespace lucerna {
namespace {

constexpr std::size_t kSlices = 8;

// The chi-square of 7 degrees of freedom exceeds this with a probability of 0.001.
constexpr double kBeyondChance = 24.3;

// A block's mean assumes this many additional trials, with the mean of the block from which it was cut: a few
// trials that brought nothing do not prove that none ever will. Lights, which have no block above them, use
// the mean of all.
constexpr double kInherited = 4, kInheritedByLight = 1;

float number(const LeSampleU& u, int axis) {
    switch (axis) {
        case 0:
            return u.position.x;
        case 1:
            return u.position.y;
        case 2:
            return u.direction.x;
        default:
            return u.direction.y;
    }
}

// Represents a block under construction.
struct Block {
    std::span<EmissionTrial> trials;
    std::array<float, 4> low{};
    std::array<int, 4> cuts{};
    double mean = 0;  // second moment, with the additional trials
    double each = 1;  // what one additional trial counts

    float width(int axis) const { return std::ldexp(1.0F, -cuts[static_cast<std::size_t>(axis)]); }
    int depth() const { return cuts[0] + cuts[1] + cuts[2] + cuts[3]; }
    double plain() const { return std::ldexp(1.0, -depth()); }  // share of its light's plain draws
};

struct Cut {
    double gain;  // decrease of the root of the second moment, relative to all lights' draws
    std::uint32_t light;
    std::uint32_t node;
    int axis;

    // Puts the most gainful first; among equals the earliest.
    bool operator<(const Cut& other) const {
        if (gain != other.gain) return gain < other.gain;
        if (light != other.light) return light > other.light;
        return node > other.node;
    }
};

// Sums over trials: their weights, the squares of these, and the weighted scores.
struct Sums {
    double weight = 0, square = 0, score = 0;

    void add(const EmissionTrial& trial) {
        const double w{trial.weight};
        weight += w;
        square += w * w;
        score += w * double{trial.score};
    }
};
Sums sums_of(std::span<const EmissionTrial> trials) {
    Sums sums;
    for (const EmissionTrial& trial : trials) sums.add(trial);
    return sums;
}

// Returns by how much the root of the mean falls if the block is cut into slices along the axis; none if the
// slices do not differ beyond chance. `variance` is that of the sum of the weighted differences from the
// mean, over the sum of the weights.
std::optional<double> gain_along(const Block& block, int axis, double mean, double variance) {
    std::array<Sums, kSlices> slices{};
    const float low = block.low[static_cast<std::size_t>(axis)];
    const float scale = static_cast<float>(kSlices) / block.width(axis);
    for (const EmissionTrial& trial : block.trials) {
        const auto slice = static_cast<std::size_t>((number(trial.u, axis) - low) * scale);
        slices[std::min(slice, kSlices - 1)].add(trial);
    }
    double chi = 0, roots = 0;
    for (const Sums& slice : slices) {
        const double more = slice.score - slice.weight * mean, inherited = kInherited * block.each;
        if (slice.weight > 0) chi += more * more / slice.weight;
        roots += std::sqrt((slice.score + inherited * mean) / (slice.weight + inherited));
    }
    if (!(chi > kBeyondChance * variance)) return std::nullopt;
    return std::sqrt(mean) - roots / kSlices;
}

class Learner {
  public:
    Learner(std::span<std::vector<EmissionTrial>> trials, std::span<const double> powers,
            const BlockSettings& settings)
        : settings_(settings), made_(trials.size()), blocks_(trials.size()), shares_(trials.size()) {
        double sum = 0, count = 0, power = 0;
        for (std::size_t i = 0; i < trials.size(); ++i) {
            const Sums sums = sums_of(trials[i]);
            sum += sums.score;
            count += sums.weight;
            power += powers[i];
        }
        const double mean = count > 0 ? sum / count : 0.0;
        for (std::size_t i = 0; i < trials.size(); ++i) {
            shares_[i] = power > 0 ? powers[i] / power : 0.0;
            Block whole;
            whole.trials = trials[i];
            settle(whole, mean, kInheritedByLight);
            blocks_[i].push_back(whole);
            made_[i].nodes[0].importance = std::sqrt(whole.mean);
            propose(static_cast<std::uint32_t>(i), 0);
        }
    }

    std::vector<EmissionBlocks> run() {
        for (std::size_t left = settings_.most_cuts; left > 0 && !queue_.empty(); --left) {
            const Cut cut = queue_.top();
            queue_.pop();
            apply(cut);
        }
        return std::move(made_);
    }

  private:
    // `additional` trials have the mean `inherited`, and the mean weight of those of the block.
    static void settle(Block& block, double inherited, double additional) {
        const Sums sums = sums_of(block.trials);
        if (sums.weight > 0) block.each = sums.square / sums.weight;
        const double weight = additional * block.each;  // > 0
        block.mean = (sums.score + weight * inherited) / (sums.weight + weight);
    }

    // Proposes to cut the block along the axis where that gains most.
    void propose(std::uint32_t light, std::uint32_t node) {
        const Block& block = blocks_[light][node];
        if (block.trials.size() < settings_.least_trials || block.depth() >= EmissionBlocks::kMostCuts)
            return;
        const Sums sums = sums_of(block.trials);  // of some trials, whose weights are > 0
        const double mean = sums.score / sums.weight;
        double variance = 0;
        for (const EmissionTrial& trial : block.trials) {
            const double apart = double{trial.weight} * (double{trial.score} - mean);
            variance += apart * apart;
        }
        variance /= sums.weight;
        std::optional<Cut> best;
        for (int axis = 0; axis < 4; ++axis) {
            if (block.cuts[static_cast<std::size_t>(axis)] >= EmissionBlocks::kMostCutsOfAxis) continue;
            const auto gain = gain_along(block, axis, mean, variance);
            if (!gain) continue;
            const double whole = *gain * block.plain() * shares_[light];
            if (!best || whole > best->gain) best = Cut{whole, light, node, axis};
        }
        if (best && best->gain > 0) queue_.push(*best);
    }

    void apply(const Cut& cut) {
        std::vector<EmissionBlocks::Node>& nodes = made_[cut.light].nodes;
        const auto child = static_cast<std::uint32_t>(nodes.size());
        nodes[cut.node] = {cut.axis, child, 0};
        const Block whole = blocks_[cut.light][cut.node];
        const auto axis = static_cast<std::size_t>(cut.axis);
        const float middle = whole.low[axis] + 0.5F * whole.width(cut.axis);
        const auto upper =
            std::partition(whole.trials.begin(), whole.trials.end(),
                           [&](const EmissionTrial& trial) { return number(trial.u, cut.axis) < middle; });
        const auto below = static_cast<std::size_t>(upper - whole.trials.begin());
        for (const bool above : {false, true}) {
            Block half = whole;
            half.trials = above ? whole.trials.subspan(below) : whole.trials.first(below);
            ++half.cuts[axis];
            if (above) half.low[axis] = middle;
            settle(half, whole.mean, kInherited);
            blocks_[cut.light].push_back(half);
            nodes.push_back({-1, 0, std::sqrt(half.mean)});
        }
        propose(cut.light, child);
        propose(cut.light, child + 1);
    }

    BlockSettings settings_;
    std::vector<EmissionBlocks> made_;
    std::vector<std::vector<Block>> blocks_;  // parallel to each light's nodes
    std::vector<double> shares_;              // of each light in the total power
    std::priority_queue<Cut> queue_;
};

}  // namespace

std::vector<EmissionBlocks> learn_blocks(std::span<std::vector<EmissionTrial>> trials,
                                         std::span<const double> powers, const BlockSettings& settings) {
    assert(trials.size() == powers.size());
    return Learner(trials, powers, settings).run();
}

}  // namespace lucerna
