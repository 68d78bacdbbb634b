// Statistical decisions for tests: fixed seeds, one stated error rate.
//
// A correct program fails a test of this kind with probability kFalseAlarm at most, over the choice of the
// seed; the seeds are fixed, so a run that passes once always passes.
#pragma once

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
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

// Observed counts against expected ones (same total). Bins that expect fewer than 5 are pooled; a count in a
// bin that expects exactly nothing rejects outright.
inline ChiSquare chi_square(std::span<const std::uint64_t> observed, std::span<const double> expected) {
    ChiSquare result;
    double pooled_expected = 0;
    double pooled_observed = 0;
    int bins = 0;
    for (std::size_t i = 0; i < observed.size(); ++i) {
        if (expected[i] <= 0 && observed[i] > 0) return {INFINITY, 1, 0.0};
        if (expected[i] < 5) {
            pooled_expected += expected[i];
            pooled_observed += static_cast<double>(observed[i]);
            continue;
        }
        const double difference = static_cast<double>(observed[i]) - expected[i];
        result.statistic += difference * difference / expected[i];
        ++bins;
    }
    if (pooled_expected >= 5) {
        const double difference = pooled_observed - pooled_expected;
        result.statistic += difference * difference / pooled_expected;
        ++bins;
    }
    result.degrees = bins - 1;
    if (result.degrees < 1) return result;
    const boost::math::chi_squared distribution(result.degrees);
    result.p_value = boost::math::cdf(boost::math::complement(distribution, result.statistic));
    return result;
}

// Is the mean of the samples within `sigmas` standard errors of `truth`? (4 sigma: 6e-5 two-sided.)
inline bool agrees(const RunningStats& stats, double truth, double sigmas = 4) {
    return std::fabs(stats.mean() - truth) <= sigmas * stats.standard_error() + 1e-12 * std::fabs(truth);
}

// Student's t: how often the mean of so many normal values would be as far from `truth` as this one is, or
// farther. For few values, whose scatter is known by themselves alone; normal is what each is nearly if it is
// itself a sum over many.
inline double t_test(const RunningStats& stats, double truth) {
    if (stats.count() < 2) return 1;
    const double off = std::fabs(stats.mean() - truth);
    if (off <= 0) return 1;
    if (!(stats.standard_error() > 0)) return 0;
    const boost::math::students_t distribution(static_cast<double>(stats.count() - 1));
    return 2 * boost::math::cdf(boost::math::complement(distribution, off / stats.standard_error()));
}

}  // namespace lucerna::testing
