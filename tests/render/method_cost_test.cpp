#include "engine/render/method_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lucerna {
namespace method_cost_test {

using Kind = MethodCost::Kind;

// Evaluates the cost model by hand.

MethodCost rays(double sample, double variance) {
    MethodCost cost;
    cost.sample = sample;
    cost.variance = variance;
    return cost;
}

MethodCost maps(double prepare, double most_work) {
    MethodCost cost = rays(0.5, 0.01);
    cost.kind = Kind::maps;
    cost.prepare = prepare;
    cost.beyond = 0.04;
    cost.power = 1;
    cost.most_work = most_work;
    return cost;
}

TEST(MethodCost, Rays_ErrorFallsByTheRootOfTime) {
    const MethodCost cost = rays(0.5, 4);
    EXPECT_DOUBLE_EQ(best_in(8, cost).error, std::sqrt(4.0 / 16));
    EXPECT_DOUBLE_EQ(soonest_below(0.5, cost).seconds, 8);
    EXPECT_TRUE(std::isinf(best_in(0.4, cost).error)) << "not one sample of every pixel";
    EXPECT_DOUBLE_EQ(soonest_below(100, cost).seconds, 0.5) << "no less than one sample";
}

TEST(MethodCost, Maps_WorkGrowsWithTheTimeThereIs) {
    const MethodCost cost = maps(0.1, 1024);
    double before = 0;
    for (const double seconds : {2.0, 20.0, 200.0}) {
        const Expectation best = best_in(seconds, cost);
        EXPECT_GT(best.work, before);
        before = best.work;
        EXPECT_LE(0.1 * best.work, 0.15 * seconds);
        const double samples = (seconds - 0.1 * best.work) / 0.5;
        EXPECT_DOUBLE_EQ(best.error, std::sqrt(0.04 / best.work + 0.01 / samples));
        // No other power of two would be better if the maps left twice the error.
        const auto square = [&](double beyond, double work) {
            return beyond / work + 0.01 / ((seconds - 0.1 * work) / 0.5);
        };
        for (double work = 1; 0.1 * work <= 0.15 * seconds; work *= 2)
            EXPECT_LE(square(4 * 0.04, best.work), square(4 * 0.04, work) + 1e-12);
    }
}

// More samples cannot remove the error that the trial's photon maps leave.
TEST(MethodCost, Maps_ErrorBelowWhatTheyLeave_NeedsMoreOfThem) {
    MethodCost cost = maps(0.1, 1);
    EXPECT_TRUE(std::isinf(soonest_below(0.1, cost).seconds));
    cost.most_work = 64;
    const Expectation enough = soonest_below(0.1, cost);
    EXPECT_LE(enough.beyond, 0.25 * 0.01) << "at most half of the error";
    EXPECT_GE(enough.work, 16);
    EXPECT_TRUE(std::isfinite(enough.seconds));
}

// A pre-pass takes as long for 4096 sets as for 16.
TEST(MethodCost, Maps_WhatIsMadeOnce_DoesNotGrowWithTheWork) {
    MethodCost cost = maps(0.001, 1024);
    cost.once = 0.5;
    const Expectation best = best_in(8, cost);
    EXPECT_GE(best.work, 256);
    EXPECT_DOUBLE_EQ(best.error, std::sqrt(0.04 / best.work + 0.01 / ((8 - 0.5 - 0.001 * best.work) / 0.5)));
    const Expectation enough = soonest_below(0.05, cost);
    EXPECT_DOUBLE_EQ(enough.seconds,
                     0.5 + 0.001 * enough.work + 0.5 * std::max(1.0, 0.01 / (0.0025 - 0.04 / enough.work)));
    EXPECT_TRUE(std::isinf(best_in(0.9, cost).error)) << "more than half of the time for what is made once";
}

// Searches take longer among more photons, so that work is worth less than if they did not.
TEST(MethodCost, Maps_WhereSamplesTakeLongerAmongMorePhotons_AreFewer) {
    MethodCost cost = maps(0.01, 8);
    cost.beyond = 1;  // eight times the photons are best
    cost.growth = 0.1;
    const Expectation best = best_in(40, cost);
    EXPECT_EQ(best.work, 8);
    const double samples = (40 - 0.08) / (0.5 * 1.3);
    EXPECT_DOUBLE_EQ(best.error, std::sqrt(1.0 / 8 + 0.01 / samples));
    const Expectation enough = soonest_below(0.75, cost);
    EXPECT_EQ(enough.work, 8) << "fewer leave more than half of the error";
    EXPECT_DOUBLE_EQ(enough.seconds, 0.08 + 0.5 * 1.3) << "one sample";
}

TEST(MethodCost, Passes_WhatIsMadeOnce_IsNoPartOfAPass) {
    MethodCost cost = rays(0.5, 0.5);
    cost.kind = Kind::passes;
    cost.prepare = 0.5;
    cost.once = 4;
    EXPECT_DOUBLE_EQ(best_in(68, cost).error, std::sqrt(0.5 / 64));
    EXPECT_TRUE(std::isinf(best_in(5.5, cost).error)) << "one pass is left";
    EXPECT_DOUBLE_EQ(soonest_below(std::sqrt(0.5 / 64), cost).seconds, 68);
}

TEST(MethodCost, Passes_BothPartsFall) {
    MethodCost cost = rays(0.5, 0.5);
    cost.kind = Kind::passes;
    cost.prepare = 0.5;
    cost.beyond = 0.01;
    cost.power = 2.0 / 3;
    cost.passes = 8;
    EXPECT_DOUBLE_EQ(best_in(64, cost).error, std::sqrt(0.01 * std::pow(8.0 / 64, 2.0 / 3) + 0.5 / 64));
    EXPECT_TRUE(std::isinf(best_in(1.5, cost).error)) << "one pass tells nothing of its noise";
    const Expectation enough = soonest_below(0.05, cost);
    EXPECT_LE(best_in(enough.seconds, cost).error, 0.05);
}

// Returns deviations as quantiles of a distribution, so the test is deterministic.
template <typename Quantile>
std::vector<double> deviations(Quantile&& quantile) {
    constexpr int kSamples = 5000;
    std::vector<double> all;
    for (int i = 0; i < kSamples; ++i) all.push_back(quantile((i + 0.5) / kSamples));
    return all;
}

TEST(TailExponent, OfFiniteVariance_IsNone) {
    EXPECT_EQ(tail_exponent(deviations([](double u) { return u; })), 0);
    EXPECT_EQ(tail_exponent(deviations([](double u) { return -std::log(1 - u); })), 0);
    EXPECT_EQ(tail_exponent(deviations([](double u) { return std::pow(1 - u, -1 / 2.5); })), 0);
    EXPECT_EQ(tail_exponent({}), 0);
    EXPECT_EQ(tail_exponent(std::vector<double>(1000, 0.0)), 0);
}

TEST(TailExponent, OfATailWithoutVariance_TellsHowItGrows) {
    const auto found = [](double index) {
        return tail_exponent(deviations([&](double u) { return std::pow(1 - u, -1 / index); }));
    };
    for (const double index : {1.2, 1.5}) EXPECT_NEAR(found(index), 2 / index - 1, 0.07) << index;
    EXPECT_EQ(found(1.8), 0) << "so light a tail blocks of different noise have together";
}

// A method whose rare samples the trial has hardly met is worse in a long render than its trial suggests.
TEST(MethodCost, HeavyTail_ErrorFallsMoreSlowly) {
    MethodCost cost = rays(0.5, 4);
    cost.seen = 0.01;
    cost.tail = 0.5;
    EXPECT_DOUBLE_EQ(variance_in(16, cost), 4 * std::sqrt(16 / 0.01));
    const Expectation best = best_in(8, cost);
    EXPECT_DOUBLE_EQ(best.error, std::sqrt(variance_in(16, cost) / 16));
    EXPECT_NEAR(soonest_below(best.error, cost).seconds, 8, 1e-6);
}

// The denoiser removes the larger share of the larger noise, but nothing of what samples miss.
TEST(MethodCost, Denoised_NoiseCountsByItsPower) {
    MethodCost cost = rays(0.5, 4);
    cost.left = 0.02;
    EXPECT_NEAR(best_in(8, cost).error, std::sqrt(0.02 * std::pow(4.0 / 16, 0.6)), 1e-9);
    EXPECT_NEAR(soonest_below(best_in(8, cost).error, cost).seconds, 8, 1e-6);
    cost.missed = 0.5;
    EXPECT_NEAR(best_in(8, cost).error, std::sqrt(0.02 * std::pow(4.0 / 16, 0.6) + 0.5 / 16), 1e-9);
    const MethodCost clean = [&cost] {
        MethodCost of = cost;
        of.variance = 1e-6;
        of.missed = 0;
        return of;
    }();
    EXPECT_NEAR(best_in(8, clean).error, std::sqrt(1e-6 / 16), 1e-12) << "never more than the noise itself";
}

}  // namespace method_cost_test
}  // namespace lucerna
