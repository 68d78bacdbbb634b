// Statistical decisions for tests, with fixed seeds and one stated error rate.
//
// A correct program fails a test of this kind with probability kFalseAlarm at most, over the choice of the
// seed; the seeds are fixed, so a run that passes once always passes.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/base/stats.h"

namespace lucerna::testing {

inline constexpr double kFalseAlarm = 1e-4;  // per test

struct ChiSquare {
    double statistic = 0;
    int degrees = 0;
    double p_value = 1;
    bool accepted() const { return p_value >= kFalseAlarm; }
};

// Returns the probability that chi-square of so many degrees of freedom is at least this large.
double chi_square_tail(double statistic, int degrees);

// Compares observed counts with expected ones (same total). Bins that expect fewer than 5 are pooled; a count
// in a bin that expects exactly 0 rejects outright.
ChiSquare chi_square(std::span<const std::uint64_t> observed, std::span<const double> expected);

// Tells whether the mean of the samples is within `sigmas` standard errors of `truth` (4 sigma: 6e-5
// two-sided).
inline bool agrees(const RunningStats& stats, double truth, double sigmas = 4) {
    return std::fabs(stats.mean() - truth) <= sigmas * stats.standard_error() + 1e-12 * std::fabs(truth);
}

// Returns the two-sided p-value of Student's t-test that the mean is `truth`. For few values, whose variance
// must be estimated from themselves; each value is nearly normal if it is a sum over many.
double t_test(const RunningStats& stats, double truth);

}  // namespace lucerna::testing
