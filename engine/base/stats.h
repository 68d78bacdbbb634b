// Computes running mean and variance, and detects outliers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lucerna {

// Computes mean and variance without cancellation, whatever the offset [Welford 1962].
class RunningStats {
  public:
    void add(double x) {
        ++n_;
        const double delta = x - mean_;
        mean_ += delta / static_cast<double>(n_);
        m2_ += delta * (x - mean_);
    }

    std::uint64_t count() const { return n_; }
    double mean() const { return mean_; }
    // Returns the unbiased sample variance; 0 for fewer than two values.
    double variance() const { return n_ > 1 ? m2_ / static_cast<double>(n_ - 1) : 0.0; }
    // Returns the standard deviation of mean() for independent values.
    double standard_error() const { return n_ > 0 ? std::sqrt(variance() / static_cast<double>(n_)) : 0.0; }

  private:
    std::uint64_t n_ = 0;
    double mean_ = 0;
    double m2_ = 0;
};

struct Weighed {
    double value, weight;
};

// Returns the least value that has, together with those below it, `share` of the weight. Requires values,
// weights >= 0 and a share in [0, 1]. Reorders the values; takes time in proportion to their number.
inline double weighted_quantile(std::vector<Weighed>& values, double share) {
    double wanted = 0;
    for (const Weighed& v : values) wanted += share * v.weight;
    auto first = values.begin(), last = values.end();
    while (last - first > 1) {
        const auto middle = first + (last - first) / 2;
        std::nth_element(first, middle, last,
                         [](const Weighed& a, const Weighed& b) { return a.value < b.value; });
        double below = 0;
        for (auto v = first; v != middle; ++v) below += v->weight;
        if (below >= wanted) {
            last = middle;
        } else {
            wanted -= below;
            first = middle;
        }
    }
    return first->value;
}

// Returns the limit above which values are outliers: at most a thousandth of all values, each more than a
// hundred times as large as any other value, with a sum larger than that of the others. Returns infinity
// without outliers. Values must not be negative.
inline double limit_of_most(std::vector<double> values) {
    constexpr std::size_t kFew = 1000;
    constexpr double kApart = 100;
    const std::size_t few = values.size() / kFew;
    if (few == 0) return INFINITY;
    const auto first = values.end() - static_cast<std::ptrdiff_t>(few) - 1;
    std::nth_element(values.begin(), first, values.end());
    const double limit = kApart * *first;
    double most = 0, apart = 0;
    for (const double v : values) (v > limit ? apart : most) += v;
    return apart > most ? limit : INFINITY;
}

}  // namespace lucerna
