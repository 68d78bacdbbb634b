// Tests light paths in media: the ledger, the Volume map, VPLs, and the density estimate in space.
#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "engine/vpl/vpl.h"
#include "photon/build_maps.h"
#include "photon/volume_estimate.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace media_test {

using testing::homogeneous;
using testing::SceneMaker;

constexpr std::array<bool, kMapKinds> kAll{true, true, true, true};
constexpr auto kVolume = static_cast<std::size_t>(MapKind::volume);

PhotonMaps build(const Scene& scene, std::int64_t paths, bool volume_direct = true, int threads = 2) {
    Monitor silent;
    MapParameters parameters;
    parameters.paths = paths;
    parameters.wanted = kAll;
    parameters.seed = 5;
    parameters.volume_direct = volume_direct;
    return build_photon_maps(scene, parameters, Workers{threads}, silent);
}

// Returns a light of Φ = 4π W in the middle of a ball in vacuum.
Scene ball(const Medium& medium, float radius = 2) {
    SceneMaker make;
    make.ball_of(make.medium(medium), V3f(0.0F), radius);
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    return make.build();
}

// --- the ledger

TEST(MediaLedger, BallThatOnlyAbsorbs_LetsThroughWhatBeersLawSays) {
    const Ledger ledger = build(ball(homogeneous({0.1F, 0.5F, 2}, Rgb(0))), 2000).ledger;
    EXPECT_LT(ledger.imbalance(), 1e-5);
    const double sigma[] = {0.1, 0.5, 2};
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(ledger.escaped[k] / ledger.emitted[k], std::exp(-2 * sigma[k]), 1e-5) << k;
        EXPECT_NEAR(ledger.media[k] / ledger.emitted[k], 1 - std::exp(-2 * sigma[k]), 1e-5) << k;
    }
    EXPECT_EQ(ledger.scatterings, 0U);
}

TEST(MediaLedger, EndlessCloud_AbsorbsAllAndScattersTheSeries) {
    // At every collision the share a is scattered: the power scattered is Φ (a + a² + …).
    SceneMaker make;
    make.camera_in(make.medium(homogeneous(Rgb(0.25F), Rgb(0.75F), 0.3F)));
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    const Ledger ledger = build(make.build(), 20'000).ledger;
    EXPECT_LT(ledger.imbalance(), 1e-5);
    EXPECT_EQ(ledger.escaped, V3d(0.0));
    EXPECT_NEAR((ledger.media.y + ledger.roulette.y) / ledger.emitted.y, 1, 1e-6);
    EXPECT_NEAR(ledger.roulette.y / ledger.emitted.y, 0, 0.03);
    EXPECT_NEAR(ledger.scattered.y / ledger.emitted.y, 3, 0.1);
}

TEST(MediaLedger, LosslessGreyBall_KeepsNothing) {
    const Ledger ledger = build(ball(homogeneous(Rgb(0), Rgb(3), 0.5F)), 5000).ledger;
    EXPECT_LT(ledger.imbalance(), 1e-5);
    EXPECT_NEAR(ledger.media.y / ledger.emitted.y, 0, 1e-6);
    EXPECT_NEAR(ledger.escaped.y / ledger.emitted.y, 1, 0.01);  // with the noise of Russian roulette
    EXPECT_GT(ledger.scatterings, 15'000U);
}

TEST(MediaLedger, LosslessColouredBall_KeepsNothingInTheMean) {
    RunningStats kept[3];
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        Monitor silent;
        MapParameters parameters;
        parameters.paths = 2000;
        parameters.seed = seed;
        const Scene scene = ball(homogeneous(Rgb(0), {0.3F, 1, 3}, 0.5F));
        const Ledger ledger = build_photon_maps(scene, parameters, Workers{2}, silent).ledger;
        EXPECT_LT(ledger.imbalance(), 1e-5);
        for (int k = 0; k < 3; ++k) kept[k].add(ledger.media[k] / ledger.emitted[k]);
    }
    for (const RunningStats& channel : kept) {
        EXPECT_TRUE(testing::agrees(channel, 0)) << channel.mean() << " ± " << channel.standard_error();
        EXPECT_LT(channel.standard_error(), 0.02);
        EXPECT_FALSE(testing::agrees(channel, 0.1));
    }
}

TEST(MediaLedger, RoomOfEverything_Closes) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.8F, 0.7F, 0.6F)));
    Quadric& glass = make.sphere({0.3F, 0.3F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    glass.traits.media = {true, make.medium(homogeneous({0.1F, 2, 5}, {5, 2, 1}, 0.8F)), kNoMedium};
    make.region(testing::rising_along_x(homogeneous({0.1F, 0.2F, 0.3F}, {1, 2, 3}, -0.3F), {0, 0, 0},
                                        {1, 0.5, 1}, 8));
    make.ball_of(make.medium(homogeneous(Rgb(1), Rgb(1))), {0.7F, 0.4F, 0.6F}, 0.2F);
    make.light(make_point_light({0.5F, 0.8F, 0.2F}, Rgb(0.1F, 0.2F, 0.3F)));
    make.quad_light({0.4F, 0.999F, 0.4F}, {0.2F, 0, 0}, {0, 0, 0.2F}, make.diffuse(Rgb(0)), Rgb(3, 2, 1));
    const Scene scene = make.build();
    const PhotonMaps maps = build(scene, 20'000);
    EXPECT_LT(maps.ledger.imbalance(), 1e-5);
    EXPECT_GT(maps.ledger.media.x, 0);
    EXPECT_GT(maps.counts[kVolume].stored, 1000U);
    EXPECT_EQ(scene.invalid_rays(), 0U);
    // The same holds for the light paths of VPLs.
    Monitor silent;
    const auto sets = build_vpls(scene, {4, 1024, 5, 0}, Workers{2}, silent);
    EXPECT_LT(sets.ledger.imbalance(), 1e-5);
    EXPECT_NEAR(sets.ledger.media.y / sets.ledger.emitted.y, maps.ledger.media.y / maps.ledger.emitted.y,
                0.03);
}

// --- the map

TEST(VolumeMap, AllScattering_IsThePowerOfTheMap) {
    const Scene scene = ball(homogeneous(Rgb(0.5F), Rgb(1.5F)));
    const PhotonMaps maps = build(scene, 20'000);
    double sum = 0;
    for (const Photon& p : maps.find(MapKind::volume)->photons()) sum += static_cast<double>(p.power.y);
    EXPECT_NEAR(sum / maps.ledger.scattered.y, 1, 1e-4);
    EXPECT_EQ(maps.counts[kVolume].stored, maps.ledger.scatterings);
}

TEST(VolumeMap, WithoutDirectPhotons_LacksTheFirstScatteringOnly) {
    // In a ball of optical radius 4 the power of first scattering is Φ a (1 - e^-4).
    const Scene scene = ball(homogeneous(Rgb(0.5F), Rgb(1.5F)));
    const PhotonMaps all = build(scene, 20'000), rest = build(scene, 20'000, false);
    const auto power = [](const PhotonMaps& maps) {
        double sum = 0;
        for (const Photon& p : maps.find(MapKind::volume)->photons()) sum += static_cast<double>(p.power.y);
        return sum / maps.ledger.emitted.y;
    };
    EXPECT_NEAR(power(all) - power(rest), 0.75 * (1 - std::exp(-4.0)), 0.01);
    EXPECT_EQ(rest.counts[kVolume].stored + rest.counts[kVolume].not_wanted, all.counts[kVolume].stored);
}

TEST(VolumeMap, ScatteringIsADiffuseBounce_ForTheSurfacesMaps) {
    SceneMaker make;
    make.sphere(V3f(0.0F), 3, make.diffuse(Rgb(0)));
    make.ball_of(make.medium(homogeneous(Rgb(0), Rgb(1))), V3f(0.0F), 1);
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    const PhotonMaps maps = build(make.build(), 20'000);
    const auto share = [&](MapKind kind) {
        const DepositCount& count = maps.counts[static_cast<std::size_t>(kind)];
        return static_cast<double>(count.stored + count.not_storable) / 20'000;
    };
    EXPECT_NEAR(share(MapKind::direct), std::exp(-1.0), 0.01);
    EXPECT_NEAR(share(MapKind::global), 1 - std::exp(-1.0), 0.01);
}

TEST(VolumeMap, AnyNumberOfThreads_SamePhotons) {
    const Scene scene = ball(homogeneous(Rgb(0.1F), {1, 2, 3}, 0.2F));
    const PhotonMaps one = build(scene, 10'000, true, 1), five = build(scene, 10'000, true, 5);
    const PhotonMap &a = *one.find(MapKind::volume), &b = *five.find(MapKind::volume);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
        ASSERT_EQ(a.positions()[i], b.positions()[i]);
        ASSERT_EQ(a.photons()[i].power, b.photons()[i].power);
    }
    EXPECT_EQ(one.ledger.media, five.ledger.media);
}

// --- VPLs

TEST(Vpls, InAMedium_CarryWhatIsScatteredAndTurnItAsThePhaseFunctionDoes) {
    Monitor silent;
    const Scene scene = ball(homogeneous(Rgb(0.5F), Rgb(1.5F), 0.6F));
    const auto sets = build_vpls(scene, {4, 4096, 5, 0}, Workers{2}, silent);
    double sum = 0;
    for (const Vpl& light : sets.lights) {
        ASSERT_TRUE(light.in_medium);
        sum += static_cast<double>(light.contribution.y);
    }
    EXPECT_NEAR(sum / (4 * 4096) / sets.ledger.scattered.y, 1, 1e-4);
    const Vpl& one = sets.lights.front();
    // The rounding of a unit vector's length is magnified eleven times.
    const float ahead = HenyeyGreenstein(0.6F).at_cosine(1);
    EXPECT_NEAR(one.towards(one.d), ahead, 3e-6F * ahead);
    EXPECT_FLOAT_EQ(one.towards(-one.d), HenyeyGreenstein(0.6F).at_cosine(-1));
}

// --- the estimate

// Returns photons of 1 W each, uniform in the box [0, size], all travelling along +z.
PhotonMap even_cloud(int n, std::uint64_t seed, const V3f& size = V3f(1.0F)) {
    Photons photons;
    Sampler sampler(seed, Purpose::test, 0, 0);
    for (int i = 0; i < n; ++i) {
        const V2f u = sampler.next2();
        photons.add(V3f(u.x, u.y, sampler.next()) * size, PackedDirection(),
                    {PackedDirection(V3f(0, 0, 1)), Rgb(1), 0, kNoCell});
    }
    return PhotonMap(photons, IndexKind::tree, Workers{1});
}

Scene foggy_cube(bool walls) {
    SceneMaker make;
    if (walls) make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
    // There is fog beyond the walls, too, but no photon.
    const V3d low(walls ? -1.0 : 0.0), high(walls ? 2.0 : 1.0);
    make.region(testing::in_box(homogeneous(Rgb(0), Rgb(2)), low, high));
    return make.build();
}

RunningStats estimated(const Scene& scene, const V3f& p, int k, float g, const V3f& wo) {
    RunningStats stats;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const PhotonMap map = even_cloud(4000, seed);
        const VolumeDensityEstimate density(scene, map, {k, 1});
        const Sampler sampler(9, Purpose::test, 0, seed);
        const auto found = density.in_scattered({p, HenyeyGreenstein(g), wo, kNoMedium, Rgb(2)}, sampler);
        stats.add(static_cast<double>(found.value.x));
    }
    return stats;
}

TEST(VolumeDensityEstimate, EvenCloud_IsItsDensityTimesThePhaseFunction) {
    const Scene scene = foggy_cube(false);
    for (const int k : {1, 20}) {
        const V3f wo = V3f(1, 0, 2).normalized();
        // Photons travel along z, and light scattered to the eye along wo: the cosine is wo.z.
        const double expected = 4000 * static_cast<double>(HenyeyGreenstein(0.5F).at_cosine(wo.z));
        const RunningStats stats = estimated(scene, V3f(0.5F), k, 0.5F, wo);
        if (k > 1) {
            EXPECT_TRUE(testing::agrees(stats, expected)) << stats.mean() / expected;
        }
        // With k = 1 the variance of 1/r³ is infinite; hence the wide tolerance.
        EXPECT_NEAR(stats.mean() / expected, 1, k == 1 ? 0.5 : 0.06);
        EXPECT_FALSE(testing::agrees(estimated(scene, V3f(0.5F), 20, -0.5F, wo), expected));
    }
}

// Half of the ball, a quarter or an eighth of it is inside the medium.
TEST(VolumeDensityEstimate, AtTheEndOfTheMediumAndInCorners_LosesNothing) {
    for (const bool walls : {false, true}) {
        const Scene scene = foggy_cube(walls);
        const double expected = 4000 / (4 * M_PI);
        const V3f places[] = {{0.5F, 0.5F, 1e-3F}, {1e-3F, 0.5F, 1e-3F}, V3f(1e-3F), {0.5F, 0.05F, 0.5F}};
        for (const V3f& p : places) {
            const RunningStats stats = estimated(scene, p, 20, 0, V3f(0, 1, 0));
            EXPECT_NEAR(stats.mean() / expected, 1, 0.07) << walls << ' ' << p.x << ' ' << p.y << ' ' << p.z;
        }
    }
}

// The box is rotated, so that no symmetry of the probe directions coincides with the walls: the estimated
// part of the ball that is visible varies between estimates, and division by it must be unbiased. All photons
// within a fixed radius count, which excludes other sources of bias.
TEST(VolumeDensityEstimate, BoxTurnedBy30Degrees_IsRightInTheMean) {
    M44d turn;
    turn.setAxisAngle(V3d(1, 2, 3).normalized(), M_PI / 6);
    const auto turned = [&](const V3f& p) {
        V3d out;
        turn.multVecMatrix(V3d(p - V3f(0.5F)), out);
        return V3f(out);
    };
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)), turned);
    make.region(testing::in_box(homogeneous(Rgb(0), Rgb(2)), V3d(-2), V3d(2)));
    const Scene scene = make.build();
    constexpr int kMaps = 1000, kPhotons = 2000, kEach = 4;
    const V3f places[] = {{0.5F, 0.5F, 1e-3F}, {1e-3F, 0.5F, 1e-3F}, V3f(2e-3F),
                          {0.5F, 0.05F, 0.5F}, {0.06F, 0.03F, 0.5F}, {0.5F, 0.5F, 0.13F}};
    RunningStats stats[std::size(places)];
    for (std::uint64_t seed = 0; seed < kMaps; ++seed) {
        const PhotonMap cube = even_cloud(kPhotons, seed);
        Photons photons;
        for (std::size_t i = 0; i < cube.size(); ++i) {
            photons.add(turned(cube.positions()[i]), PackedDirection(), cube.photons()[i]);
        }
        const PhotonMap map(photons, IndexKind::tree, Workers{1});
        const VolumeDensityEstimate density(scene, map, {0, 0.15F});
        for (std::size_t p = 0; p < std::size(places); ++p) {
            double sum = 0;
            for (std::uint32_t i = 0; i < kEach; ++i) {
                const Sampler sampler(9, Purpose::test, i, seed);
                const ScatteringPoint at{turned(places[p]), HenyeyGreenstein(0), V3f(0, 1, 0), kNoMedium,
                                         Rgb(2)};
                sum += static_cast<double>(density.in_scattered(at, sampler).value.x);
            }
            stats[p].add(sum / kEach / (kPhotons / (4 * M_PI)));
        }
    }
    for (std::size_t p = 0; p < std::size(places); ++p) {
        const RunningStats& one = stats[p];
        EXPECT_TRUE(testing::agrees(one, 1))
            << places[p] << ' ' << one.mean() << " ± " << one.standard_error();
        EXPECT_LT(one.standard_error(), 0.025) << places[p];
        RecordProperty(fmt::format("place{}", p),
                       fmt::format("{:.4f} ± {:.4f}, scatter {:.3f}", one.mean(), one.standard_error(),
                                   std::sqrt(one.variance())));
    }
}

TEST(VolumeDensityEstimate, BehindAWall_DoesNotCount) {
    SceneMaker make;
    make.region(homogeneous(Rgb(0), Rgb(2)));
    make.quad({-5, -5, 1.0005F}, {10, 0, 0}, {0, 10, 0}, make.diffuse(Rgb(0.5F)));
    const Scene scene = make.build();
    const RunningStats stats = estimated(scene, {0.5F, 0.5F, 1.001F}, 20, 0, V3f(0, 1, 0));
    EXPECT_EQ(stats.mean(), 0);
    EXPECT_GT(estimated(scene, {0.5F, 0.5F, 0.999F}, 20, 0, V3f(0, 1, 0)).mean(), 200);
}

TEST(VolumeDensityEstimate, FewPhotonsOrAllAtOnePoint_HaveAnAnswer) {
    const Scene scene = foggy_cube(false);
    const Sampler sampler(9, Purpose::test, 0, 0);
    const ScatteringPoint at{V3f(0.5F), HenyeyGreenstein(0), V3f(0, 1, 0), kNoMedium, Rgb(2)};
    const PhotonMap none{Photons{}};
    EXPECT_TRUE(is_black(VolumeDensityEstimate(scene, none, {50, 0.1F}).in_scattered(at, sampler).value));
    Photons same;
    for (int i = 0; i < 10; ++i)
        same.add(V3f(0.5F), PackedDirection(), {PackedDirection(V3f(0, 0, 1)), Rgb(1), 0, kNoCell});
    const PhotonMap point(same);
    // All count within the largest radius; if fewer are wanted, the radius is the smallest that float32
    // resolves.
    const auto all = VolumeDensityEstimate(scene, point, {50, 0.1F}).in_scattered(at, sampler);
    EXPECT_EQ(all.photons, 10);
    EXPECT_NEAR(static_cast<double>(all.value.x) / (10 / (4 * M_PI) / (4.0 / 3 * M_PI * 1e-3)), 1, 1e-3);
    const auto fixed = VolumeDensityEstimate(scene, point, {0, 0.2F}).in_scattered(at, sampler);
    EXPECT_EQ(fixed.photons, 10);
    EXPECT_NEAR(static_cast<double>(all.value.x / fixed.value.x), 8, 1e-3);
    const auto some = VolumeDensityEstimate(scene, point, {4, 0.1F}).in_scattered(at, sampler);
    EXPECT_EQ(some.photons, 4);
    EXPECT_GT(some.radius, 0);
    EXPECT_TRUE(is_finite(some.value));
}

}  // namespace media_test
}  // namespace lucerna
