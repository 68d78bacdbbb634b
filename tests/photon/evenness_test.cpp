// Tests the search for structure in discs: its false positive rate in even light, and its power.
#include "photon/evenness.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"

namespace lucerna {
namespace evenness_test {

// Returns the share of `trials` in which structure is found among `photons` uniform photons of power_at(x,
// y), x² + y² <= 1; black ones are dropped.
template <typename PowerAt>
double found_share(int trials, int photons, PowerAt&& power_at) {
    int found = 0;
    for (int trial = 0; trial < trials; ++trial) {
        Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(trial));
        EvennessTest test(V3f(0, 0, 1));
        for (int i = 0; i < photons; ++i) {
            const V2f u = sampler.next2();
            const float rho = std::sqrt(u.x), phi = 2 * kPi * u.y;
            const V3f at(rho * std::cos(phi), rho * std::sin(phi), 0);
            const Rgb power = power_at(at.x, at.y, sampler);
            if (!is_black(power)) test.add(at, u.x, power);
        }
        found += test.finds_structure();
    }
    return static_cast<double>(found) / trials;
}

TEST(Evenness, EvenLight_IsRefusedAtTheStatedRate) {
    constexpr int kTrials = 20'000;
    // With equal powers of one colour the three channels are one test, at a third of the rate.
    const double grey = found_share(kTrials, 240, [](float, float, Sampler&) { return Rgb(1.0F); });
    EXPECT_NEAR(grey, EvennessTest::kFalse / 3, 0.002);
    // The three channels are independent if photons have random primary colours.
    const double coloured = found_share(kTrials, 240, [](float, float, Sampler& sampler) {
        Rgb power(0.0F);
        power[static_cast<int>(3 * sampler.next())] = 1;
        return power;
    });
    EXPECT_NEAR(coloured, EvennessTest::kFalse, 0.005);
    const double unequal = found_share(
        kTrials, 240, [](float, float, Sampler& sampler) { return Rgb(0.2F + 0.8F * sampler.next()); });
    EXPECT_NEAR(unequal, EvennessTest::kFalse / 3, 0.002);
}

TEST(Evenness, StructureIsFound) {
    constexpr int kTrials = 500;
    // About half of the photons or more are kept.
    const auto share_of = [](int photons, auto&& density) {
        return found_share(kTrials, photons, [&](float x, float y, Sampler& sampler) {
            return Rgb(sampler.next() < density(x, y) ? 1.0F : 0.0F);
        });
    };
    EXPECT_GT(share_of(240, [](float x, float) { return x < 0 ? 1.0F : 0.0F; }), 0.99) << "an edge";
    EXPECT_GT(share_of(600, [](float x, float) { return 0.5F + 0.45F * x; }), 0.95) << "a gradient";
    EXPECT_GT(share_of(600, [](float x, float y) { return 1 - 0.8F * (x * x + y * y); }), 0.95) << "a spot";
    EXPECT_LT(share_of(120, [](float x, float) { return 0.5F + 0.02F * x; }), 0.05)
        << "what does not stand out of the noise";
    const double colours = found_share(
        kTrials, 240, [](float x, float, Sampler&) { return x < 0 ? Rgb(1, 0, 0) : Rgb(0, 0.3F, 0); });
    EXPECT_GT(colours, 0.99) << "two colours of about the same luminance";
}

TEST(Evenness, NoPhotons_NoStructure) {
    EXPECT_FALSE(EvennessTest(V3f(0, 1, 0)).finds_structure());
}

}  // namespace evenness_test
}  // namespace lucerna
