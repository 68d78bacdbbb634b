// Running mean and variance [Welford 1962]: no cancellation, whatever the offset.
#pragma once

#include <cmath>
#include <cstdint>

namespace lucerna {

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

}  // namespace lucerna
