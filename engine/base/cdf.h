// Samples a discrete distribution.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace lucerna {

// Represents a discrete distribution over n items. Building takes O(n), drawing O(log n).
class Cdf {
  public:
    Cdf() = default;

    // Weights must be finite and not negative. If total() is 0, no item can be drawn.
    explicit Cdf(std::span<const double> weights);

    struct Draw {
        std::size_t item;
        double probability;  // > 0
        float remainder;     // the rest of u, again uniform in [0,1)
    };

    // Draws an item for u in [0,1). Requires total() > 0. An item of weight 0 is never drawn.
    Draw draw(float u) const;

    double probability(std::size_t item) const { return (upto_[item + 1] - upto_[item]) / upto_.back(); }
    double total() const { return upto_.empty() ? 0.0 : upto_.back(); }
    std::size_t size() const { return upto_.empty() ? 0 : upto_.size() - 1; }

  private:
    std::vector<double>::const_iterator first_beyond(double x) const;

    std::vector<double> upto_;  // upto_[i] = sum of the first i weights
};

}  // namespace lucerna
