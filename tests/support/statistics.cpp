#include "tests/support/statistics.h"

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace lucerna::testing {

double chi_square_tail(double statistic, int degrees) {
    return boost::math::cdf(boost::math::complement(boost::math::chi_squared(degrees), statistic));
}

ChiSquare chi_square(std::span<const std::uint64_t> observed, std::span<const double> expected) {
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
    result.p_value = chi_square_tail(result.statistic, result.degrees);
    return result;
}

double t_test(const RunningStats& stats, double truth) {
    if (stats.count() < 2) return 1;
    const double off = std::fabs(stats.mean() - truth);
    if (off <= 0) return 1;
    if (!(stats.standard_error() > 0)) return 0;
    const boost::math::students_t distribution(static_cast<double>(stats.count() - 1));
    return 2 * boost::math::cdf(boost::math::complement(distribution, off / stats.standard_error()));
}

}  // namespace lucerna::testing
