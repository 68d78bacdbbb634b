#include "engine/scene/medium.h"

#include <gtest/gtest.h>

#include <array>

#include "engine/base/sampler.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace medium_test {

// --- The phase function

constexpr int kBins = 64;

// Returns the expected number in each bin of the cosine, by the closed form of the distribution.
std::vector<double> expected_cosines(double g, double total) {
    const auto below = [g](double c) {  // ∫ from -1 to c
        if (g == 0) return (1 + c) / 2;
        return (1 - g * g) / (2 * g) * (1 / std::sqrt(1 + g * g - 2 * g * c) - 1 / (1 + g));
    };
    std::vector<double> expected(kBins);
    for (int i = 0; i < kBins; ++i) {
        expected[static_cast<std::size_t>(i)] =
            total * (below(-1 + 2.0 * (i + 1) / kBins) - below(-1 + 2.0 * i / kBins));
    }
    return expected;
}

testing::ChiSquare cosines_against(float drawn_g, double claimed_g) {
    constexpr int kDraws = 200'000;
    std::vector<std::uint64_t> observed(kBins);
    const HenyeyGreenstein phase(drawn_g);
    const V3f wo = V3f(0.3F, -0.5F, 0.8F).normalized();
    Sampler sampler(5, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const double cosine = -static_cast<double>(wo.dot(phase.sample(wo, sampler.next2())));
        const int bin = std::clamp(static_cast<int>((cosine + 1) / 2 * kBins), 0, kBins - 1);
        ++observed[static_cast<std::size_t>(bin)];
    }
    return testing::chi_square(observed, expected_cosines(claimed_g, kDraws));
}

TEST(HenyeyGreenstein, Cosines_AreDistributedAsTheFormulaSays) {
    for (const float g : {-0.95F, -0.5F, 0.0F, 1e-4F, 0.3F, 0.8F, 0.99F}) {
        EXPECT_TRUE(cosines_against(g, static_cast<double>(g)).accepted()) << g;
    }
}

TEST(HenyeyGreenstein, AnotherG_IsRejected) {
    EXPECT_FALSE(cosines_against(0.3F, 0.32).accepted());
    EXPECT_FALSE(cosines_against(0.3F, -0.3).accepted());
}

TEST(HenyeyGreenstein, Value_IntegratesToOneAndItsMeanCosineIsG) {
    for (const float g : {-0.9F, -0.2F, 0.0F, 0.5F, 0.95F}) {
        const HenyeyGreenstein phase(g);
        double sum = 0, mean = 0;
        constexpr int kSteps = 200'000;
        for (int i = 0; i < kSteps; ++i) {
            const double cosine = -1 + (i + 0.5) * 2 / kSteps;
            const double p = 2 * M_PI * static_cast<double>(phase.at_cosine(static_cast<float>(cosine)));
            sum += p * 2 / kSteps;
            mean += p * cosine * 2 / kSteps;
        }
        EXPECT_NEAR(sum, 1, 1e-4) << g;
        EXPECT_NEAR(mean, static_cast<double>(g), 1e-4);
    }
}

TEST(HenyeyGreenstein, PositiveG_SendsLightOnAndExtremesStayFinite) {
    const V3f wo(0, 0, 1);
    EXPECT_GT(HenyeyGreenstein(0.5F).value(wo, {0, 0, -1}), HenyeyGreenstein(0.5F).value(wo, {0, 0, 1}));
    for (const float g : {-kLargestG, kLargestG}) {
        const HenyeyGreenstein phase(g);
        for (const float u : {0.0F, 0.5F, 0x1.fffffep-1F}) {
            const V3f wi = phase.sample(wo, {u, u});
            EXPECT_NEAR(wi.length(), 1, 1e-6);
            EXPECT_TRUE(std::isfinite(phase.value(wo, wi)));
        }
    }
}

// --- Densities

Box3d box_of(const V3d& a, const V3d& b) {
    return {a, b};
}

DensityGrid noise_grid(const V3i& size, DensityGrid::Border border) {
    std::vector<float> samples(static_cast<std::size_t>(size.x * size.y * size.z));
    Sampler sampler(9, Purpose::test, 1, 0);
    for (float& sample : samples) sample = sampler.next() < 0.6F ? 0 : sampler.next();
    return {size, std::move(samples), box_of({-1, 0, 2}, {1, 3, 4}), border};
}

TEST(DensityGrid, InTheMiddleOfACell_IsTheSample) {
    std::vector<float> samples(24);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = static_cast<float>(i);
    const DensityGrid grid({2, 3, 4}, samples, box_of({0, 0, 0}, {2, 3, 4}), DensityGrid::Border::zero);
    EXPECT_DOUBLE_EQ(grid.at({0.5, 0.5, 0.5}), 0);
    EXPECT_DOUBLE_EQ(grid.at({1.5, 0.5, 0.5}), 1);  // x varies fastest
    EXPECT_DOUBLE_EQ(grid.at({0.5, 1.5, 0.5}), 2);
    EXPECT_DOUBLE_EQ(grid.at({0.5, 0.5, 1.5}), 6);
    EXPECT_DOUBLE_EQ(grid.at({1.0, 1.0, 1.0}), (0 + 1 + 2 + 3 + 6 + 7 + 8 + 9) / 8.0);
    EXPECT_EQ(grid.largest(), 23);
}

TEST(DensityGrid, AtTheBoxesFace_HoldsOrFallsByHalf) {
    for (const auto border : {DensityGrid::Border::hold, DensityGrid::Border::zero}) {
        const DensityGrid grid({1, 1, 1}, {8}, box_of({0, 0, 0}, {1, 1, 1}), border);
        const bool holds = border == DensityGrid::Border::hold;
        EXPECT_DOUBLE_EQ(grid.at({0, 0.5, 0.5}), holds ? 8 : 4);
        EXPECT_DOUBLE_EQ(grid.at({1, 1, 1}), holds ? 8 : 1);
        EXPECT_DOUBLE_EQ(grid.at({0.5, 0.5, 0.5}), 8);
    }
}

// Segments join without gaps, and the density on each never exceeds its bound.
void expect_bounded(const Density& density, const V3d& o, const V3d& d, double begin, double last) {
    DensityTraversal traversal(density, o, d, begin, last);
    double at = begin;
    for (int stretches = 0;; ++stretches) {
        ASSERT_LT(stretches, 1000);
        ASSERT_GE(traversal.end(), at);
        for (int i = 0; i <= 8; ++i) {
            const double t = at + (traversal.end() - at) * i / 8;
            ASSERT_LE(traversal.at(t), traversal.bound() * (1 + 1e-9) + 1e-12) << t;
        }
        at = traversal.end();
        if (at >= last) break;
        traversal.next();
    }
    EXPECT_EQ(at, last);
}

TEST(DensityTraversal, AlongAnyRay_BoundsTheGridFromEndToEnd) {
    Sampler sampler(2, Purpose::test, 2, 0);
    for (const auto border : {DensityGrid::Border::hold, DensityGrid::Border::zero}) {
        Medium medium;
        medium.density = noise_grid({13, 7, 9}, border);
        medium.box = box_of({-1, 0, 2}, {1, 3, 4});
        int crossed = 0;
        for (int i = 0; i < 2000; ++i) {
            const V3f o(4 * sampler.next() - 2, 5 * sampler.next() - 1, 6 * sampler.next());
            V3f d(2 * sampler.next() - 1, 2 * sampler.next() - 1, 2 * sampler.next() - 1);
            if (i % 5 == 0) d[i % 3] = 0;  // parallel to the grid's cell faces
            if (i % 7 == 0) d = V3f(i % 3 == 0, i % 3 == 1, i % 3 == 2);
            const auto found = crossing(medium, {o, d.normalized()}, 100);
            if (!found) continue;
            ++crossed;
            expect_bounded(medium.density, V3d(o), V3d(d.normalized()), found->entry, found->exit);
        }
        EXPECT_GT(crossed, 300);
    }
}

TEST(DensityTraversal, Exponential_BoundsBothWaysAndLevel) {
    const Density density = ExponentialDensity{2, 3, {0, 1, 0}, {0, -1, 0}};
    EXPECT_DOUBLE_EQ(density_at(density, {5, -1, 7}), 2);
    EXPECT_DOUBLE_EQ(density_at(density, {5, 0, 7}), 2 * std::exp(-3.0));
    for (const V3d& d : {V3d(0, 1, 0), V3d(0, -1, 0), V3d(1, 0, 0), V3d(0.6, 0.8, 0)}) {
        expect_bounded(density, {0, 0.5, 0}, d, 0.1, 5);
    }
}

// --- Crossings

TEST(MediaTraversal, OfABoxInItsOwnSpace_IsMeasuredInSceneUnits) {
    Medium medium;
    medium.box = box_of({0, 0, 0}, {1, 1, 1});
    M44d scene_from_medium;
    scene_from_medium.scale(V3d(2, 2, 2));
    scene_from_medium[3][0] = 5;  // x from 5 to 7
    medium.medium_from_scene = scene_from_medium.inverse();
    const auto found = crossing(medium, {{0, 1, 1}, {1, 0, 0}}, INFINITY);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->entry, 5, 1e-12);
    EXPECT_NEAR(found->exit, 7, 1e-12);
    EXPECT_FALSE(crossing(medium, {{0, 1, 1}, {-1, 0, 0}}, INFINITY));
    EXPECT_FALSE(crossing(medium, {{0, 3, 1}, {1, 0, 0}}, INFINITY));
    EXPECT_FALSE(crossing(medium, {{0, 1, 1}, {1, 0, 0}}, 4.5));
    EXPECT_EQ(crossing(medium, {{6, 1, 1}, {1, 0, 0}}, INFINITY)->entry, 0);
    EXPECT_EQ(crossing(medium, {{6, 1, 1}, {1, 0, 0}}, 0.25)->exit, 0.25);
}

TEST(MediumTowards, OnlyAnInterfaceChangesTheMedium) {
    const MediumInterface bounding{true, 1, 2}, none{false, 1, 2};
    EXPECT_EQ(medium_towards(bounding, {0, 0, 1}, {0, 0.6F, 0.8F}, 7), 2);
    EXPECT_EQ(medium_towards(bounding, {0, 0, 1}, {0, 0.6F, -0.8F}, 7), 1);
    EXPECT_EQ(medium_towards(none, {0, 0, 1}, {0, 0.6F, -0.8F}, 7), 7);
}

}  // namespace medium_test
}  // namespace lucerna
