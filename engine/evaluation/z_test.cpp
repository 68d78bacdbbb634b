#include "engine/evaluation/z_test.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"

namespace lucerna {
namespace {

constexpr std::array<double, 3> kSigmas{2, 3, 4};

// Returns P(|z| > sigmas) of a normal variate.
double two_tails(double sigmas) {
    return std::erfc(sigmas / std::sqrt(2.0));
}

double bonferroni(double p, std::size_t tests) {
    return std::min(1.0, p * static_cast<double>(tests));
}

}  // namespace

double sidak_level(double level, std::uint64_t tests) {
    if (tests == 0) return level;
    return -expm1(log1p(-level) / static_cast<double>(tests));
}

double sidak_p_value(double smallest_p, std::uint64_t tests) {
    if (tests == 0) return 1;
    if (smallest_p >= 1) return 1;
    return -expm1(static_cast<double>(tests) * log1p(-smallest_p));
}

double binomial_excess(std::uint64_t observed, std::uint64_t tests, double chance) {
    const double n = static_cast<double>(tests), k = static_cast<double>(observed);
    if (k <= n * chance) return 1;
    // Computes the first term by logarithms and the others by their ratios, which decrease because k is above
    // the mean.
    double term = exp(log_gamma(n + 1) - log_gamma(k + 1) - log_gamma(n - k + 1) +
                           k * log(chance) + (n - k) * log1p(-chance));
    const double odds = chance / (1 - chance);
    double sum = 0;
    for (double i = k; i <= n && term > 1e-17 * sum; ++i) {
        sum += term;
        term *= (n - i) / (i + 1) * odds;
    }
    return std::min(1.0, sum);
}

ZTester::ZTester(std::vector<std::string> channels, int width, int cell, double level)
    : cell_(cell), across_((width + cell - 1) / cell), cells_(channels.size()) {
    for (std::string& name : channels) channels_.push_back({std::move(name), 0, {}, 0, 0, 0});
    test_.cell = cell;
    test_.level = level;
}

void ZTester::add(int x, int y, std::size_t channel, double difference, double variance) {
    if (!(variance > 0) || !std::isfinite(variance)) {
        // Equal constants agree whatever their noise; different ones cannot be judged without a variance.
        test_.untestable += difference != 0;
        return;
    }
    if (cell_ == 1) {
        test(x, y, channels_[channel], {difference, variance});
        return;
    }
    std::vector<Sum>& cells = cells_[channel];
    const std::size_t at = static_cast<std::size_t>(y / cell_) * static_cast<std::size_t>(across_) +
                           static_cast<std::size_t>(x / cell_);
    if (at >= cells.size()) cells.resize(at + 1);
    cells[at].difference += difference;
    cells[at].variance += variance;
}

void ZTester::test(int x, int y, Channel& channel, const Sum& sum) {
    const double z = sum.difference / std::sqrt(sum.variance);  // add() accepts only variances > 0
    const double p = std::erfc(std::fabs(z) / std::sqrt(2.0));
    ++channel.tests;
    channel.difference += sum.difference;
    channel.variance += sum.variance;
    channel.z += z;
    for (std::size_t i = 0; i < kSigmas.size(); ++i) channel.beyond[i] += std::fabs(z) > kSigmas[i];
    p_values_.push_back(p);
    if (p < test_.smallest_p) {
        test_.smallest_p = p;
        test_.x = x;
        test_.y = y;
        test_.channel = channel.name;
    }
}

void ZTester::judge_largest() {
    test_.tests = p_values_.size();
    test_.corrected_level = sidak_level(test_.level, test_.tests);
    test_.rejected = static_cast<std::uint64_t>(std::count_if(
        p_values_.begin(), p_values_.end(), [&](double p) { return p < test_.corrected_level; }));
    test_.p_value = sidak_p_value(test_.smallest_p, test_.tests);
}

void ZTester::judge_beyond() {
    for (std::size_t i = 0; i < kSigmas.size(); ++i) {
        BeyondSigma& beyond = test_.beyond[i];
        beyond.sigmas = kSigmas[i];
        beyond.expected = two_tails(kSigmas[i]);
        for (const Channel& channel : channels_) {
            beyond.values += channel.beyond[i];
            const double p = binomial_excess(channel.beyond[i], channel.tests, beyond.expected);
            beyond.p_value = std::min(beyond.p_value, bonferroni(p, channels_.size()));
        }
        if (test_.tests > 0)
            beyond.share = static_cast<double>(beyond.values) / static_cast<double>(test_.tests);
    }
}

void ZTester::judge_mean() {
    std::uint64_t pixels = 0;  // number of independent values, that of the largest channel
    for (const Channel& channel : channels_) {
        pixels = std::max(pixels, channel.tests);
        test_.mean_z += channel.z;
        if (channel.tests == 0) continue;
        const double p = std::erfc(std::fabs(channel.difference) / std::sqrt(2 * channel.variance));  // > 0
        test_.mean_p = std::min(test_.mean_p, bonferroni(p, channels_.size()));
    }
    if (test_.tests == 0) return;
    test_.mean_z /= static_cast<double>(test_.tests);
    // The mean over a pixel's channels has a variance of at most 1, reached if they are fully correlated.
    test_.mean_z_error = 1 / std::sqrt(static_cast<double>(pixels));
}

ZTest ZTester::finish() {
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        for (std::size_t i = 0; i < cells_[c].size(); ++i) {
            if (cells_[c][i].variance == 0) continue;  // empty cell
            const int at = static_cast<int>(i);
            test(at % across_ * cell_, at / across_ * cell_, channels_[c], cells_[c][i]);
        }
    }
    judge_largest();
    judge_beyond();
    judge_mean();
    double beyond_p = 1;
    for (const BeyondSigma& beyond : test_.beyond)
        beyond_p = std::min(beyond_p, bonferroni(beyond.p_value, test_.beyond.size()));
    const std::pair<double, const char*> questions[] = {
        {test_.p_value, "largest"}, {beyond_p, "beyond"}, {test_.mean_p, "mean"}};
    const auto& least = *std::min_element(std::begin(questions), std::end(questions),
                                          [](const auto& a, const auto& b) { return a.first < b.first; });
    test_.verdict_p = bonferroni(least.first, std::size(questions));
    test_.answered_by = least.second;
    return std::move(test_);
}

}  // namespace lucerna
