// Density estimation against known densities.
#include "photon/gather.h"

#include <gtest/gtest.h>

#include "engine/base/stream.h"
#include "engine/base/warp.h"
#include "photon/irradiance.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

const V3f kUp(0, 0, 1);

Hit floor_hit(const V3f& p) {
    Hit hit;
    hit.at = {p, kUp, surface_error(p, 1)};
    hit.ns = kUp;
    hit.dpdu = V3f(1, 0, 0);
    return hit;
}

Bsdf white() {
    return Bsdf(DiffuseLobe{Rgb(1.0F)}, kUp, kUp, V3f(1, 0, 0));
}

Photon photon(const V3f& d, float power) {
    return {PackedDirection(d), Rgb(power), 0, kNoCell};
}

// n photons of total power 1 on the unit square z = 0, arriving from a cosine-distributed sky.
PhotonMap uniform_map(int n, std::uint64_t seed) {
    Stream stream(seed, Purpose::test, 0, 0);
    Photons landed;
    for (int i = 0; i < n; ++i) {
        const V3f p(stream.next(), stream.next(), 0);
        landed.add(p, PackedDirection(kUp),
                   photon(-square_to_cosine_hemisphere(stream.next2()), 1.0F / static_cast<float>(n)));
    }
    return PhotonMap(landed);
}

struct Convention {
    int k;
    float radius;
    KernelShape kernel;
    MetricKind metric;
};

class KnownDensity : public ::testing::TestWithParam<Convention> {};

// White Lambertian floor under irradiance 1: radiance 1/π. The estimate must be unbiased under every
// convention.
TEST_P(KnownDensity, Mean_WithinFourSigma) {
    const Convention c = GetParam();
    const GatherSettings settings{c.k, c.radius, 2, c.kernel, c.metric};
    RunningStats stats;
    RunningStats wrong;  // what dividing by the k-th photon's radius while counting it would give
    for (std::uint64_t seed = 0; seed < 3000; ++seed) {
        const PhotonMap map = uniform_map(2000, seed);
        const GatherResult result = Gather(map, settings).radiance(floor_hit({0.5F, 0.5F, 0}), white(), kUp);
        stats.add(static_cast<double>(result.value.x * kPi));
        wrong.add(static_cast<double>(result.value.x * kPi) * (c.k + 1) / c.k);
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
                      Convention{100'000, 0.1F, KernelShape::constant, MetricKind::euclidean}));

TEST(Gather, EmptyMap_IsBlack) {
    const PhotonMap map(Photons{});
    const GatherResult result = Gather(map, {}).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.value, Rgb(0.0F));
    EXPECT_EQ(result.photons, 0);
}

TEST(Gather, OnePhoton_CountsInTheLargestRadius) {
    Photons landed;
    landed.add(V3f(0.1F, 0, 0), PackedDirection(kUp), photon(-kUp, 3));
    const PhotonMap map(landed);
    const GatherSettings settings{100, 0.5F, 2, KernelShape::constant, MetricKind::projected};
    const GatherResult result = Gather(map, settings).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.photons, 1);
    EXPECT_NEAR(result.value.x, 3 / (kPi * 0.25F) / kPi, 1e-5F);
}

TEST(Gather, CoincidentPhotons_GiveAFiniteAnswer) {
    Photons landed;
    for (int i = 0; i < 50; ++i) landed.add(V3f(1.0F, 1, 0), PackedDirection(kUp), photon(-kUp, 1));
    const PhotonMap map(landed);
    const GatherSettings settings{10, 0.5F, 2, KernelShape::epanechnikov, MetricKind::projected};
    const GatherResult result = Gather(map, settings).radiance(floor_hit({1, 1, 0}), white(), kUp);
    EXPECT_EQ(result.photons, 10);
    EXPECT_TRUE(is_finite(result.value));
    EXPECT_GT(result.value.x, 0);
}

TEST(Gather, ThinWallLitFromBehind_StaysDarkAndKeepsItsRadius) {
    // Ten photons from below lie nearer than five from above: they neither count nor take up places.
    Photons landed;
    for (int i = 1; i <= 10; ++i) {
        landed.add(V3f(0.01F * static_cast<float>(i), 0, 0), PackedDirection(-kUp), photon(kUp, 100));
    }
    for (int i = 1; i <= 5; ++i) {
        landed.add(V3f(0, 0.2F + 0.01F * static_cast<float>(i), 0), PackedDirection(kUp), photon(-kUp, 1));
    }
    const PhotonMap map(landed);
    const GatherSettings settings{4, 1, 2, KernelShape::constant, MetricKind::projected};
    const GatherResult result = Gather(map, settings).radiance(floor_hit(V3f(0.0F)), white(), kUp);
    EXPECT_EQ(result.photons, 4);
    EXPECT_NEAR(result.radius, 0.25F, 1e-6F);
    EXPECT_NEAR(result.value.x, 4 / (kPi * 0.0625F) / kPi, 1e-3F);
}

TEST(IrradiancePoints, UniformFloor_SameMeanAsTheMap_AndOnlyOnItsSide) {
    Monitor silent;
    const PhotonMap map = uniform_map(20'000, 1);
    const GatherSettings settings{100, 0.3F, 2, KernelShape::epanechnikov, MetricKind::projected};
    const PhotonMap* maps[] = {&map};
    const IrradiancePoints points(maps, settings, 4, Workers{2}, silent);
    EXPECT_EQ(points.size(), 5000U);
    RunningStats stats;
    Stream stream(2, Purpose::test, 0, 0);
    for (int i = 0; i < 2000; ++i) {
        const V3f x(0.2F + 0.6F * stream.next(), 0.2F + 0.6F * stream.next(), 0);
        const auto found = points.nearest(x, kUp, 0.1F);
        ASSERT_TRUE(found);
        stats.add(static_cast<double>(found->irradiance.x));
    }
    EXPECT_NEAR(stats.mean(), 1, 0.02);
    EXPECT_FALSE(points.nearest(V3f(0.5F, 0.5F, 0), -kUp, 0.1F));
    EXPECT_FALSE(points.nearest(V3f(0.5F, 0.5F, 1), kUp, 0.1F));
}

}  // namespace
}  // namespace lucerna
