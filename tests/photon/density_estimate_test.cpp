// Tests density estimation against known densities.
#include "photon/density_estimate.h"

#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "tests/support/photons.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace gather_test {

using testing::floor_hit;
using testing::kUp;
using testing::photon;
using testing::uniform_map;
using testing::white;

struct Convention {
    int k;
    float radius;
    KernelShape kernel;
    MetricKind metric;
};

class KnownDensity : public ::testing::TestWithParam<Convention> {};

// On a white Lambertian floor with irradiance 1 the radiance is 1/π. The estimate must be unbiased for every
// convention (4 sigmas).
TEST_P(KnownDensity, Mean_WithinFourSigma) {
    const Convention c = GetParam();
    const DensityEstimateSettings settings{c.k, c.radius, 2, c.kernel, c.metric, Boundary::none};
    RunningStats stats;
    RunningStats wrong;  // the result if the k-th photon fixed the radius and counted as well
    for (std::uint64_t seed = 0; seed < 750; ++seed) {
        const PhotonMap map = uniform_map(2000, seed);
        const DensityEstimate estimate(map, settings);
        // One value per map, from four places that share no photon and are far from edges.
        double sum = 0;
        for (const float x : {0.3F, 0.7F}) {
            for (const float y : {0.3F, 0.7F}) {
                const Rgb value = estimate.radiance(floor_hit({x, y, 0}), white(), kUp).value;
                sum += static_cast<double>(value.x * kPi) / 4;
            }
        }
        stats.add(sum);
        wrong.add(sum * (c.k + 1) / c.k);
    }
    EXPECT_TRUE(testing::agrees(stats, 1)) << stats.mean() << " ± " << stats.standard_error();
    if (c.radius > 0.2F && c.k <= 10) {
        EXPECT_FALSE(testing::agrees(wrong, 1)) << "the test cannot see a wrong k";
    }
}

INSTANTIATE_TEST_SUITE_P(
    Conventions, KnownDensity,
    ::testing::Values(Convention{1, 0.3F, KernelShape::constant, MetricKind::projected},
                      Convention{2, 0.3F, KernelShape::constant, MetricKind::euclidean},
                      Convention{10, 0.3F, KernelShape::constant, MetricKind::projected},
                      Convention{10, 0.3F, KernelShape::cone, MetricKind::projected},
                      Convention{50, 0.3F, KernelShape::epanechnikov, MetricKind::projected},
                      Convention{100'000, 0.1F, KernelShape::epanechnikov, MetricKind::projected},
                      Convention{100'000, 0.1F, KernelShape::constant, MetricKind::euclidean},
                      Convention{0, 0.1F, KernelShape::constant, MetricKind::projected},
                      Convention{0, 0.1F, KernelShape::cone, MetricKind::projected},
                      Convention{0, 0.1F, KernelShape::epanechnikov, MetricKind::euclidean}));

// Around a bright spot the photons' density falls, and the radius grows with distance. If each photon is
// spread over its own disc, the floor receives exactly the flux of all photons.
TEST(DensityEstimate, SpreadPhotons_KeepTheFlux) {
    Sampler sampler(7, Purpose::test, 0, 0);
    Photons photons;
    constexpr int kCount = 4000;
    const V3f middle(0.5F, 0.5F, 0);
    const auto radius = [&](const V3f& p) { return 0.02F + 0.2F * (p - middle).length(); };
    for (int i = 0; i < kCount; ++i) {
        const float r = 0.25F * sampler.next(), phi = 2 * kPi * sampler.next();  // a density of 1/r
        photons.add(V3f(0.5F + r * std::cos(phi), 0.5F + r * std::sin(phi), 0), PackedDirection(kUp),
                    photon(-kUp, 1.0F / kCount));
    }
    const PhotonMap map(photons, IndexKind::tree, Workers{1});
    std::vector<float> radii;
    for (const V3f& p : map.positions()) radii.push_back(radius(p));

    double spread = 0, by_place = 0;
    constexpr int kSide = 400;
    for (int i = 0; i < kSide * kSide; ++i) {
        const V3f x((0.5F + static_cast<float>(i % kSide)) / kSide,
                    (0.5F + static_cast<float>(i / kSide)) / kSide, 0);
        DensityEstimateSettings how{
            0, radius(x), 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
        const SurfacePoint at{x, kUp, 0};
        by_place += static_cast<double>(DensityEstimate(map, how).irradiance(at).value.x);
        how.radius *= 2;
        spread += static_cast<double>(DensityEstimate(map, how, radii).irradiance(at).value.x);
    }
    EXPECT_NEAR(spread / (kSide * kSide), 1, 0.001);
    EXPECT_GT(by_place / (kSide * kSide), 1.02) << "the test cannot see what spreading is for";
}

TEST(DensityEstimate, EmptyMap_IsBlack) {
    const PhotonMap map(Photons{});
    const DensityEstimateResult result =
        DensityEstimate(map, {}).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.value, Rgb(0.0F));
    EXPECT_EQ(result.photons, 0);
}

TEST(DensityEstimate, OnePhoton_CountsInTheLargestRadius) {
    Photons deposited;
    deposited.add(V3f(0.1F, 0, 0), PackedDirection(kUp), photon(-kUp, 3));
    const PhotonMap map(deposited);
    const DensityEstimateSettings settings{
        100, 0.5F, 2, KernelShape::constant, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.photons, 1);
    EXPECT_NEAR(result.value.x, 3 / (kPi * 0.25F) / kPi, 1e-5F);
}

TEST(DensityEstimate, CoincidentPhotons_GiveAFiniteAnswer) {
    Photons deposited;
    for (int i = 0; i < 50; ++i) deposited.add(V3f(1.0F, 1, 0), PackedDirection(kUp), photon(-kUp, 1));
    const PhotonMap map(deposited);
    const DensityEstimateSettings settings{
        10, 0.5F, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).radiance(floor_hit({1, 1, 0}), white(), kUp);
    EXPECT_EQ(result.photons, 10);
    EXPECT_TRUE(is_finite(result.value));
    EXPECT_GT(result.value.x, 0);
}

TEST(DensityEstimate, ThinWallLitFromBehind_StaysDarkAndKeepsItsRadius) {
    // Ten photons from below are nearer than five from above: they neither count nor affect the radius.
    Photons deposited;
    for (int i = 1; i <= 10; ++i) {
        deposited.add(V3f(0.01F * static_cast<float>(i), 0, 0), PackedDirection(-kUp), photon(kUp, 100));
    }
    for (int i = 1; i <= 5; ++i) {
        deposited.add(V3f(0, 0.2F + 0.01F * static_cast<float>(i), 0), PackedDirection(kUp), photon(-kUp, 1));
    }
    const PhotonMap map(deposited);
    const DensityEstimateSettings settings{
        4, 1, 2, KernelShape::constant, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.photons, 4);
    EXPECT_NEAR(result.radius, 0.25F, 1e-6F);
    EXPECT_NEAR(result.value.x, 4 / (kPi * 0.0625F) / kPi, 1e-3F);
}

TEST(DensityEstimate, KBeyondTheMap_EqualsAllWithinTheRadius) {
    const PhotonMap map = uniform_map(500, 7);
    for (const KernelShape kernel : {KernelShape::constant, KernelShape::cone, KernelShape::epanechnikov}) {
        DensityEstimateSettings settings{100'000, 0.2F, 2, kernel, MetricKind::projected, Boundary::none};
        const DensityEstimateResult most =
            DensityEstimate(map, settings).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        settings.k = 0;
        const DensityEstimateResult all =
            DensityEstimate(map, settings).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        EXPECT_NEAR(most.value.x, all.value.x, 1e-5F);  // summed in another order
        EXPECT_EQ(most.photons, all.photons);
        EXPECT_EQ(all.radius, 0.2F);
        EXPECT_GT(all.photons, 30);
    }
}

// Without boundaries the sharper value is the estimate on a disc of kInnerRadius times the radius; on discs
// given by the nearest photons it has the same mean where the light is even (4 sigmas).
TEST(DensityEstimate, Sharper_IsTheEstimateOnAQuarterOfTheRadius) {
    const PhotonMap map = uniform_map(5000, 7);
    for (const KernelShape kernel : {KernelShape::constant, KernelShape::cone, KernelShape::epanechnikov}) {
        DensityEstimateSettings settings{0, 0.2F, 2, kernel, MetricKind::projected, Boundary::none};
        settings.sharper = true;
        const DensityEstimateResult wide =
            DensityEstimate(map, settings).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        const std::vector<float> radii(map.size(), 0.2F);
        const DensityEstimateResult by_photon =
            DensityEstimate(map, settings, radii).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        settings.radius *= kInnerRadius;
        settings.sharper = false;
        const DensityEstimateResult small =
            DensityEstimate(map, settings).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        EXPECT_GT(small.photons, 10);
        EXPECT_NEAR(wide.sharper.x, small.value.x, 1e-5F * small.value.x);
        EXPECT_NEAR(by_photon.sharper.x, small.value.x, 1e-5F * small.value.x);
        EXPECT_EQ(small.sharper, Rgb(0));
        EXPECT_NE(wide.value, small.value);
    }
    DensityEstimateSettings nearest{
        50, 1, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
    nearest.sharper = true;
    RunningStats value, sharper;
    for (int i = 0; i < 36; ++i) {
        const V3f at(0.2F + 0.1F * static_cast<float>(i % 6), 0.2F + 0.1F * static_cast<float>(i / 6), 0);
        const DensityEstimateResult found =
            DensityEstimate(map, nearest).radiance(floor_hit(at), white(), kUp);
        value.add(double{found.value.x});
        sharper.add(double{found.sharper.x});
    }
    EXPECT_NEAR(sharper.mean(), value.mean(), 4 * sharper.standard_error());
}

TEST(DensityEstimate, AllWithinTheRadius_NoneThere_IsBlackOfThatRadius) {
    const PhotonMap map = uniform_map(500, 7);
    const DensityEstimateSettings settings{
        0, 0.25F, 2, KernelShape::cone, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).radiance(floor_hit({5, 5, 0}), white(), kUp);
    EXPECT_EQ(result.value, Rgb(0.0F));
    EXPECT_EQ(result.radius, 0.25F);
    EXPECT_EQ(result.photons, 0);
}

TEST(DensityEstimate, OneOfTwoPhotons_TheSecondFixesTheRadius) {
    Photons deposited;
    deposited.add(V3f(0.1F, 0, 0), PackedDirection(kUp), photon(-kUp, 3));
    deposited.add(V3f(0, 0.2F, 0), PackedDirection(kUp), photon(-kUp, 50));
    const PhotonMap map(deposited);
    const DensityEstimateSettings settings{
        1, 0.5F, 2, KernelShape::constant, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.photons, 1);
    EXPECT_NEAR(result.radius, 0.2F, 1e-6F);
    EXPECT_NEAR(result.value.x, 3 / (kPi * 0.04F) / kPi, 1e-3F);
}

TEST(DensityEstimate, CoincidentPhotonsWithinARadius_AllCountAtTheKernelsPeak) {
    Photons deposited;
    for (int i = 0; i < 50; ++i) deposited.add(V3f(1.0F, 1, 0), PackedDirection(kUp), photon(-kUp, 1));
    const PhotonMap map(deposited);
    const DensityEstimateSettings settings{
        0, 0.5F, 2, KernelShape::epanechnikov, MetricKind::projected, Boundary::none};
    const DensityEstimateResult result =
        DensityEstimate(map, settings).irradiance({V3f(1, 1, 0), kUp, 1e-6F});
    EXPECT_EQ(result.photons, 50);
    EXPECT_NEAR(result.value.x, 50 * 2 / (kPi * 0.25F), 1e-2F);
}

}  // namespace gather_test
}  // namespace lucerna
