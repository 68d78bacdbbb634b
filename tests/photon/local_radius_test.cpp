// Tests the radius that holds k photons, on photons of known density.
#include "photon/local_radius.h"

#include <gtest/gtest.h>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace local_radius_test {

const V3f kUp(0, 0, 1);

// Returns `n` photons of 1 W in all that arrive from above on [-1,1]² of the plane z = 0.
PhotonMap uniform_square(int n, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    Photons photons;
    for (int i = 0; i < n; ++i) {
        const V2f u = sampler.next2();
        photons.add({2 * u.x - 1, 2 * u.y - 1, 0}, PackedDirection(kUp),
                    {PackedDirection(-kUp), Rgb(1.0F / static_cast<float>(n)), 0, kNoCell});
    }
    return PhotonMap(photons);
}

DensityEstimateSettings nearest(int k, float largest) {
    DensityEstimateSettings how;
    how.k = k;
    how.radius = largest;
    return how;
}

TEST(LocalRadius, UniformDensity_HoldsKPhotons) {
    constexpr int kPhotons = 20'000, kNearest = 50;
    const PhotonMap map = uniform_square(kPhotons, 1);
    const LocalRadius radius(map, {.how = nearest(kNearest, 1), .points = 2000}, Workers{2});
    RunningStats r2;
    for (float x = -0.7F; x <= 0.7F; x += 0.05F) {
        for (float y = -0.7F; y <= 0.7F; y += 0.05F) r2.add(double{sqr(radius.at({x, y, 0}, kUp).radius)});
    }
    // The expected area is (k+1)/(photons per area): radii are computed at photons, and k + 1 of the other
    // photons are found.
    EXPECT_NEAR(r2.mean() * M_PI * kPhotons / 4, kNearest + 1, 3);
    EXPECT_GT(r2.variance(), 0) << "it is local";
}

TEST(LocalRadius, FewPhotonsOrWrongSideOrNone_IsTheLargest) {
    const PhotonMap few = uniform_square(20, 2);
    EXPECT_EQ(
        LocalRadius(few, {.how = nearest(50, 0.5F), .points = 100}, Workers{}).at(V3f(0.0F), kUp).radius,
        0.5F);
    const PhotonMap many = uniform_square(20'000, 3);
    const LocalRadius radius(many, {.how = nearest(50, 0.5F), .points = 100}, Workers{});
    EXPECT_LT(radius.at(V3f(0.0F), kUp).radius, 0.2F);
    EXPECT_EQ(radius.at(V3f(0.0F), -kUp).radius, 0.5F) << "no photon came from below";
    EXPECT_EQ(radius.at({3, 0, 0}, kUp).radius, 0.5F) << "none near";
    EXPECT_EQ(LocalRadius(PhotonMap(Photons{}), {.how = nearest(50, 0.5F), .points = 100}, Workers{})
                  .at(V3f(0.0F), kUp)
                  .radius,
              0.5F);
}

TEST(LocalRadius, AllPhotonsAtOnePoint_IsTheLargest) {
    Photons photons;
    for (int i = 0; i < 100; ++i) {
        photons.add(V3f(0.0F), PackedDirection(kUp), {PackedDirection(-kUp), Rgb(1.0F), 0, kNoCell});
    }
    EXPECT_EQ(LocalRadius(PhotonMap(photons), {.how = nearest(50, 0.5F), .points = 100}, Workers{})
                  .at(V3f(0.0F), kUp)
                  .radius,
              0.5F);
}

TEST(LocalRadius, AnyNumberOfThreads_SameRadii) {
    const PhotonMap map = uniform_square(5000, 4);
    const LocalRadius one(map, {.how = nearest(20, 1), .points = 1000}, Workers{1}),
        five(map, {.how = nearest(20, 1), .points = 1000}, Workers{5});
    for (float x = -1; x < 1; x += 0.1F)
        EXPECT_EQ(one.at({x, 0, 0}, kUp).radius, five.at({x, 0, 0}, kUp).radius);
}

// Returns photons of uniform density, of which those at x > 0 are brighter.
PhotonMap two_halves(int n, float brighter) {
    const PhotonMap even = uniform_square(n, 5);
    Photons photons;
    for (std::size_t i = 0; i < even.size(); ++i) {
        Photon photon = even.photons()[i];
        if (even.positions()[i].x > 0) photon.power *= brighter;
        photons.add(even.positions()[i], even.normals()[i], photon);
    }
    return PhotonMap(photons);
}

TEST(LocalRadius, WiderWhereEven_HoldsMoreButForEdges) {
    constexpr int kPhotons = 20'000, kNearest = 50;
    const PhotonMap map = two_halves(kPhotons, 4);
    const LocalRadius radius(map, {.how = nearest(kNearest, 1), .points = 2000, .wider_where_even = true},
                             Workers{2});
    const auto photons = [&](float x) {
        RunningStats r2;
        for (float y = -0.7F; y <= 0.7F; y += 0.02F) r2.add(double{sqr(radius.at({x, y, 0}, kUp).radius)});
        return r2.mean() * M_PI * kPhotons / 4;
    };
    EXPECT_NEAR(photons(0.5F), LocalRadius::kWider * (kNearest + 1), 15);
    EXPECT_NEAR(photons(-0.5F), LocalRadius::kWider * (kNearest + 1), 15);
    EXPECT_LT(photons(0), 0.5 * LocalRadius::kWider * kNearest) << "where the light changes";
}

TEST(LocalRadius, Whole_WhereNothingCutsOffTheDisc) {
    testing::SceneMaker make;
    const auto white = make.diffuse(Rgb(0.5F));
    make.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, white);
    make.quad({0.5F, -1, 0}, {0, 2, 0}, {0, 0, 1}, white);  // a wall
    const Scene scene = make.build();
    const PhotonMap map = uniform_square(20'000, 6);
    const LocalRadius::Parameters parameters{.how = nearest(50, 1), .points = 8000, .scene = &scene};
    const LocalRadius radius(map, parameters, Workers{2});
    const auto share = [&](float x) {
        RunningStats whole;
        for (float y = -0.7F; y <= 0.7F; y += 0.02F) whole.add(radius.at({x, y, 0}, kUp).whole ? 1 : 0);
        return whole.mean();
    };
    EXPECT_GT(share(0), 0.8);
    EXPECT_GT(share(-0.5F), 0.8);
    EXPECT_EQ(share(-0.98F), 0) << "at an edge";
    EXPECT_EQ(share(0.48F), 0) << "at a wall";
    EXPECT_EQ(share(0.52F), 0) << "behind it";
}

}  // namespace local_radius_test
}  // namespace lucerna
