// The regression, on planes whose fits are known.
#include "engine/denoise/regression.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace lucerna {
namespace regression_test {

constexpr int kWide = 40, kHigh = 28;

struct Planes {
    FeaturePlanes features;
    std::array<HalfPlanes, 2> halves;
};

Plane plane(float value) {
    Plane result(kWide, kHigh);
    result.fill({1}, [value](int /*x*/, int /*y*/) { return value; });
    return result;
}

// Returns a plane wall, of which the normals vary by less than what makes pixels differ.
Planes wall(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> vary(-0.1F, 0.1F);
    Planes planes;
    FeaturePlanes& f = planes.features;
    for (std::size_t c = 0; c < 3; ++c) {
        f.albedo[c] = plane(0.5F);
        f.geometric_normal[c] = f.position[c] = plane(0);
        f.normal[c] = Plane(kWide, kHigh);
        f.normal[c].fill({1}, [&](int /*x*/, int /*y*/) { return vary(random); });
    }
    f.emitter = plane(0), f.inverse_footprint = plane(1), f.inverse_albedo = plane(0.2F);
    f.inside = Plane(kWide, kHigh);
    for (int y = 0; y < kHigh; ++y) std::fill_n(f.inside.row(y), kWide, 1.0F);
    for (HalfPlanes& half : planes.halves)
        half.own = half.guide = plane(1), half.own_noise = half.noise = half.trust = plane(1);
    return planes;
}

// Light that is a linear function of the terms stays as it is, except for the damping of slopes by a
// thousandth of the sum of weights, whatever the weights.
TEST(Regression, LightThatIsLinearInFeatures_StaysAsItIs) {
    Planes planes = wall(1);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> any(0.1F, 1);
    for (HalfPlanes& half : planes.halves) {
        half.trust.fill({1}, [&](int /*x*/, int /*y*/) { return any(random); });
        for (std::size_t c = 0; c < 3; ++c) {
            half.value[c] = Plane(kWide, kHigh);
            half.value[c].fill({1}, [&](int x, int y) {
                return 5 + 0.02F * static_cast<float>(x) - 0.03F * static_cast<float>(y);
            });
        }
    }
    const auto filtered = regress(kWide, kHigh, planes.features, planes.halves, {1}).light;
    const Plane& linear = filtered[0][static_cast<std::size_t>(Candidate::linear)][1];
    for (int y = 0; y < kHigh; ++y) {
        for (int x = 0; x < kWide; ++x)
            EXPECT_NEAR(linear.row(y)[x], planes.halves[0].value[1].row(y)[x], 0.01F);
    }
}

// A mean over all fits that reach a pixel preserves a constant exactly, but for rounding.
TEST(Regression, ConstantLight_StaysAsItIs) {
    Planes planes = wall(3);
    for (HalfPlanes& half : planes.halves) half.value = {plane(1), plane(2), plane(3)};
    const auto filtered = regress(kWide, kHigh, planes.features, planes.halves, {2}).light;
    for (const auto& half : filtered) {
        for (const auto& candidate : half) {
            for (int x = 0; x < kWide; ++x) EXPECT_NEAR(candidate[2].row(kHigh / 2)[x], 3, 1e-4F);
        }
    }
}

// Fits of noisy light fall below 0 at edges of windows, and would make an image with negative light. Without
// the raise to 0 some values are below it.
TEST(Regression, LightThatIsNowhereNegative_StaysSo) {
    Planes planes = wall(6);
    std::mt19937 random(7);
    std::exponential_distribution<float> light(1);
    for (HalfPlanes& half : planes.halves) {
        for (Plane& p : half.value) {
            p = Plane(kWide, kHigh);
            // The light falls to 0 over a few columns.
            p.fill({1},
                   [&](int x, int /*y*/) { return light(random) * static_cast<float>(std::max(0, 20 - x)); });
        }
    }
    const auto filtered = regress(kWide, kHigh, planes.features, planes.halves, {1}).light;
    float least = 1, at_zero = 0;
    for (const auto& candidate : filtered[0]) {
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x) {
                least = std::min(least, candidate[0].row(y)[x]);
                at_zero += x < 30 && candidate[0].row(y)[x] == 0;
            }
        }
    }
    EXPECT_GE(least, 0);
    EXPECT_GT(at_zero, 0) << "some fits fell below";
    // Fits that fell far below the weighted mean are raised to a share of it.
    int raised = 0;
    for (int y = 0; y < kHigh; ++y) {
        const float *const linear = filtered[0][0][0].row(y), *const mean = filtered[0][1][0].row(y);
        for (int x = 0; x < kWide; ++x) {
            ASSERT_GE(linear[x], 0.2999F * mean[x]) << x << ' ' << y;
            raised += mean[x] > 0 && linear[x] < 0.3001F * mean[x];
        }
    }
    EXPECT_GT(raised, 0);
}

// An image that is made of one half does not depend on the other half, which can therefore judge it.
TEST(Regression, AHalf_DoesNotInfluenceTheOther) {
    Planes planes = wall(4);
    std::mt19937 random(5);
    std::exponential_distribution<float> light(1);
    const auto draw = [&](HalfPlanes& half) {
        for (Plane& p : half.value) {
            p = Plane(kWide, kHigh);
            p.fill({1}, [&](int /*x*/, int /*y*/) { return light(random); });
        }
        half.guide.fill({1}, [&](int /*x*/, int /*y*/) { return 4 * light(random); });
    };
    for (HalfPlanes& half : planes.halves) draw(half);
    const auto before = regress(kWide, kHigh, planes.features, planes.halves, {1}).light;
    draw(planes.halves[1]);
    const auto after = regress(kWide, kHigh, planes.features, planes.halves, {1}).light;
    for (std::size_t candidate = 0; candidate < kCandidates; ++candidate) {
        for (int y = 0; y < kHigh; ++y) {
            for (int x = 0; x < kWide; ++x)
                EXPECT_EQ(before[0][candidate][0].row(y)[x], after[0][candidate][0].row(y)[x]);
        }
    }
}

}  // namespace regression_test
}  // namespace lucerna
