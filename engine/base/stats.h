// Running mean and variance, and values that stand apart.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lucerna {

// No cancellation, whatever the offset [Welford 1962].
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
    // Unbiased sample variance; 0 for fewer than two values.
    double variance() const { return n_ > 1 ? m2_ / static_cast<double>(n_ - 1) : 0.0; }
    // Standard deviation of mean() for independent values.
    double standard_error() const { return n_ > 0 ? std::sqrt(variance() / static_cast<double>(n_)) : 0.0; }

  private:
    std::uint64_t n_ = 0;
    double mean_ = 0;
    double m2_ = 0;
};

// Above which values stand apart from all others: at most a thousandth of them, a hundred times as large as
// any other, and larger together than the others' sum. Infinity: none do. Values are not negative.
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
