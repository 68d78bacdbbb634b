// Tests light paths: classes of paths, the energy ledger, determinism.
#include "photon/light_path.h"

#include <gtest/gtest.h>

#include <regex>

#include "engine/vpl/vpl.h"
#include "photon/build_maps.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace light_path_test {

using testing::SceneMaker;

constexpr std::array<bool, kMapKinds> kAll{true, true, true};

PhotonMaps build(const Scene& scene, std::int64_t paths, int threads = 2) {
    Monitor silent;
    return build_photon_maps(scene, {paths, kAll, 5, 0}, Workers{threads}, silent);
}

class RecordingMonitor final : public Monitor {
  public:
    void warn(std::string_view line) override { warnings.emplace_back(line); }
    std::vector<std::string> warnings;
};

double total_power(const PhotonMap& map) {
    double sum = 0;
    for (const Photon& p : map.photons()) sum += static_cast<double>(luminance(p.power));
    return sum;
}

// Returns a room with glass, mirror, rough metal, colours and three kinds of light.
Scene busy_room() {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.8F, 0.7F, 0.6F));
    make.room({1, 1, 1}, white);
    make.sphere({0.3F, 0.3F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    make.sphere({0.7F, 0.3F, 0.3F}, 0.15F, make.material(MirrorMaterial{}));
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(0.3F);
    make.sphere({0.5F, 0.3F, 0.7F}, 0.15F, make.material(metal));
    make.quad_light({0.4F, 0.999F, 0.4F}, {0.2F, 0, 0}, {0, 0, 0.2F}, make.diffuse(Rgb(0)), Rgb(3, 2, 1));
    make.light(make_point_light({0.5F, 0.8F, 0.2F}, Rgb(0.1F, 0.2F, 0.3F)));
    make.light(make_spot_light({0.2F, 0.9F, 0.5F}, V3f(0.2F, -1, 0).normalized(), Rgb(1, 1, 1), {30, 10}));
    return make.build();
}

TEST(Maps, WithTargets_EmitUntilTheyAreMet) {
    const Scene scene = busy_room();
    RecordingMonitor monitor;
    MapParameters parameters;
    parameters.paths = 1;
    parameters.wanted = kAll;
    parameters.seed = 5;
    parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = 30'000;
    const PhotonMaps maps = build_photon_maps(scene, parameters, Workers{2}, monitor);
    EXPECT_GE(maps.find(MapKind::caustic)->size(), 30'000U);
    EXPECT_LT(maps.find(MapKind::caustic)->size(), 60'000U);
    EXPECT_GT(maps.ledger.paths, 65'536U) << "the first look is not enough";
    EXPECT_TRUE(monitor.warnings.empty());
    // The same number of paths without a target makes the same maps.
    const PhotonMaps again = build(scene, static_cast<std::int64_t>(maps.ledger.paths));
    EXPECT_EQ(total_power(*maps.find(MapKind::caustic)), total_power(*again.find(MapKind::caustic)));
    EXPECT_EQ(total_power(*maps.find(MapKind::global)), total_power(*again.find(MapKind::global)));
}

TEST(Maps, WithATargetOutOfReach_GiveItUpAndSaySo) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0)));
    make.light(make_point_light({0.5F, 0.5F, 0.5F}, Rgb(1)));
    RecordingMonitor monitor;
    MapParameters parameters;
    parameters.paths = 1;
    parameters.wanted = kAll;
    parameters.targets[static_cast<std::size_t>(MapKind::global)] = 1'000'000;
    const PhotonMaps maps = build_photon_maps(make.build(), parameters, Workers{2}, monitor);
    EXPECT_EQ(maps.find(MapKind::global)->size(), 0U);
    ASSERT_EQ(monitor.warnings.size(), 1U);
    EXPECT_NE(monitor.warnings.front().find("target of 1000000 is abandoned"), std::string::npos);
}

// The target needs far more light paths than the deadline allows. The maps of those traced hold all of the
// power.
TEST(Maps, WithATargetAndADeadline_EndWhenItComes) {
    const Scene scene = busy_room();
    RecordingMonitor monitor;
    MapParameters parameters;
    parameters.paths = 1;
    parameters.wanted = kAll;
    parameters.seed = 5;
    parameters.targets[static_cast<std::size_t>(MapKind::caustic)] = 1'000'000;
    parameters.deadline = Deadline::after(0.3);
    const Stopwatch watch;
    const PhotonMaps maps = build_photon_maps(scene, parameters, Workers{2}, monitor);
    EXPECT_LT(watch.seconds(), 5) << "generous: the machine may be busy";
    EXPECT_LT(maps.find(MapKind::caustic)->size(), 1'000'000U);
    EXPECT_TRUE(monitor.warnings.empty());
    const PhotonMaps again = build(scene, static_cast<std::int64_t>(maps.ledger.paths));
    EXPECT_EQ(total_power(*maps.find(MapKind::caustic)), total_power(*again.find(MapKind::caustic)));
}

// With chains the Caustic map holds L(S+D)*S+D: of the Global map's paths those without two diffuse bounces
// in a row.
TEST(Maps, OfCausticChains_HoldTheirShareOfTheGlobalMap) {
    const Scene scene = busy_room();
    constexpr std::int64_t kPaths = 50'000;
    const SamplerFamily numbers(5, Purpose::emission, 0);
    struct Chains : LightPathVisitor {
        double expected = 0, first = 0;
        std::string bounces;  // bounces of the path so far, as letters
        PathClass last;

        void hit(const LightPathHit& at) {
            if (at.path.specular > last.specular) bounces += 'S';
            if (at.path.non_specular > last.non_specular) bounces += 'D';
            last = at.path;
            if (!stores_photons(at.bsdf)) return;
            if (std::regex_match(bounces, std::regex("(S+D)*S+"))) expected += double{luminance(at.power)};
            if (std::regex_match(bounces, std::regex("S+"))) first += double{luminance(at.power)};
        }
    } found;
    Emission emission(scene, 5, Purpose::emission, 0);
    emission.for_each(0, kPaths, [&](std::uint32_t path, const std::optional<LightPathStart>& start) {
        found.bounces.clear();
        found.last = {};
        if (start) trace_light_path(scene, *start, numbers.path(path), {}, found);
    });
    const double expected = found.expected / kPaths, first = found.first / kPaths;
    ASSERT_GT(expected, 1.01 * first);

    MapParameters parameters;
    parameters.paths = kPaths;
    parameters.seed = 5;
    parameters.wanted[static_cast<std::size_t>(MapKind::caustic)] = true;
    Monitor silent;
    const PhotonMaps alone = build_photon_maps(scene, parameters, Workers{2}, silent);
    EXPECT_NEAR(total_power(*alone.find(MapKind::caustic)), first, 1e-5 * first);
    parameters.caustic_chains = true;
    const PhotonMaps chains = build_photon_maps(scene, parameters, Workers{2}, silent);
    EXPECT_NEAR(total_power(*chains.find(MapKind::caustic)), expected, 1e-5 * expected);
    EXPECT_LT(chains.ledger.imbalance(), 1e-5);
    // Paths end where no requested map can store later hits.
    EXPECT_LT(alone.ledger.hits, chains.ledger.hits);
    EXPECT_LT(chains.ledger.hits, found.ledger.hits / 2);
}

// Where light bounces between mirrors fewer paths are traced, and the maps hold the same power.
TEST(Maps, BetweenMirrors_AreMadeOfFewerPaths_AndHoldTheSamePower) {
    SceneMaker make;
    ConductorMaterial mirror;
    mirror.reflectance = RgbTexture::constant(Rgb(1.0F));
    make.sphere(V3f(0.0F), 1, make.material(mirror));
    make.sphere({0.5F, 0, 0}, 0.1F, make.diffuse(Rgb(0.5F)));
    make.light(make_point_light({-0.5F, 0.1F, 0}, Rgb(1.0F)));
    const Scene scene = make.build();
    MapParameters parameters;
    parameters.paths = 40'000;
    parameters.seed = 5;
    parameters.wanted[static_cast<std::size_t>(MapKind::caustic)] = true;
    RecordingMonitor unbound;
    const PhotonMaps all = build_photon_maps(scene, parameters, Workers{2}, unbound);
    EXPECT_TRUE(unbound.warnings.empty());
    EXPECT_EQ(all.ledger.paths, 40'000U);
    const double bounces = static_cast<double>(all.ledger.hits) / 40'000;
    parameters.most_mean_bounces = static_cast<int>(bounces / 4);
    RecordingMonitor monitor;
    const PhotonMaps bound = build_photon_maps(scene, parameters, Workers{2}, monitor);
    ASSERT_EQ(monitor.warnings.size(), 1U);
    EXPECT_NE(monitor.warnings.front().find("light paths"), std::string::npos);
    EXPECT_LE(bound.ledger.hits, all.ledger.hits / 3);
    EXPECT_GE(bound.ledger.paths, 4096U);
    EXPECT_LT(bound.ledger.imbalance(), 1e-3);
    const double power = total_power(*all.find(MapKind::caustic));
    EXPECT_NEAR(total_power(*bound.find(MapKind::caustic)) / power, 1, 0.1);
}

TEST(Ledger, EveryKindOfSurfaceAndLight_ClosesToOneHundredThousandth) {
    const PhotonMaps maps = build(busy_room(), 50'000);
    EXPECT_LT(maps.ledger.imbalance(), 1e-5);
    EXPECT_GT(maps.ledger.emitted.x, 0);
    EXPECT_EQ(maps.ledger.paths, 50'000U);
}

TEST(Ledger, APathThatIsNotBooked_IsSeen) {
    Ledger ledger = build(busy_room(), 1000).ledger;
    ledger.absorbed *= 1 - 1e-4;
    EXPECT_GT(ledger.imbalance(), 1e-5);
}

TEST(Ledger, RouletteTakesWhatItGives) {
    // The mean is 0; over independent passes the mean must lie within four of its standard errors.
    const Scene scene = busy_room();
    Monitor silent;
    RunningStats share;
    for (std::uint32_t pass = 0; pass < 40; ++pass) {
        const PhotonMaps maps = build_photon_maps(scene, {2000, kAll, 5, pass}, Workers{2}, silent);
        share.add(maps.ledger.roulette.y / maps.ledger.emitted.y);
    }
    EXPECT_TRUE(testing::agrees(share, 0)) << share.mean() << " ± " << share.standard_error();
}

TEST(Ledger, ClosedBox_NothingEscapes_AndEmittedIsTheLightsFlux) {
    SceneMaker make;
    make.room({1, 2, 3}, make.diffuse(Rgb(0.5F)));
    make.light(make_point_light({0.5F, 1, 1}, Rgb(1, 2, 3)));
    const PhotonMaps maps = build(make.build(), 20'000);
    EXPECT_EQ(maps.ledger.escaped, V3d(0.0));
    EXPECT_NEAR(maps.ledger.emitted.y, 2 * 4 * M_PI, 1e-4);
    // With an albedo of 1/2 the Direct map holds the flux Φ, and the Global map Φ (1/2 + 1/4 + …) = Φ.
    EXPECT_NEAR(total_power(*maps.find(MapKind::direct)) / total_power(*maps.find(MapKind::global)), 1, 0.02);
}

TEST(LightPath, AlbedoOneInAClosedBox_Ends) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(1.0F)));
    make.light(make_point_light(V3f(0.5F), Rgb(1.0F)));
    const PhotonMaps maps = build(make.build(), 200);
    EXPECT_LT(maps.ledger.imbalance(), 1e-5);
    EXPECT_LT(maps.ledger.hits, 200U * 3000U);
}

TEST(LightPath, MirrorBoxWithAPointLight_Ends) {
    SceneMaker make;
    make.room({1, 1, 1}, make.material(MirrorMaterial{RgbTexture::constant(Rgb(1.0F))}));
    make.light(make_point_light(V3f(0.4F, 0.5F, 0.6F), Rgb(1.0F)));
    const PhotonMaps maps = build(make.build(), 100);
    EXPECT_LT(maps.ledger.imbalance(), 1e-5);
}

TEST(Deposit, PathClasses_GoToTheirMaps) {
    EXPECT_EQ(map_of({0, 0}), MapKind::direct);
    EXPECT_EQ(map_of({3, 0}), MapKind::caustic);
    EXPECT_EQ(map_of({0, 1}), MapKind::global);
    EXPECT_EQ(map_of({2, 1}), MapKind::global);
}

TEST(Deposit, MirrorUnderALight_MakesCausticPhotonsOnTheCeiling) {
    // Light shines straight down on a mirror; the reflected light is stored on the ceiling as LSD.
    SceneMaker make;
    make.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0},
              make.material(MirrorMaterial{RgbTexture::constant(Rgb(0.5F))}));
    make.quad({-9, 2, -9}, {20, 0, 0}, {0, 0, 20}, make.diffuse(Rgb(0)));
    make.light(make_spot_light({0.5F, 1, 0.5F}, {0, -1, 0}, Rgb(1.0F), {10, 5}));
    const PhotonMaps maps = build(make.build(), 10'000);
    EXPECT_EQ(maps.counts[static_cast<int>(MapKind::direct)].stored, 0U);
    EXPECT_EQ(maps.counts[static_cast<int>(MapKind::direct)].not_storable, 10'000U);
    EXPECT_EQ(maps.counts[static_cast<int>(MapKind::global)].stored, 0U);
    EXPECT_GT(maps.counts[static_cast<int>(MapKind::caustic)].stored, 4000U);
    EXPECT_NEAR(total_power(*maps.find(MapKind::caustic)), 0.5 * maps.ledger.emitted.y,
                0.02 * maps.ledger.emitted.y);
}

TEST(BuildMaps, AnyNumberOfThreads_SamePhotons) {
    const Scene scene = busy_room();
    const PhotonMaps one = build(scene, 30'000, 1);
    for (const int threads : {2, 3, 8}) {
        const PhotonMaps many = build(scene, 30'000, threads);
        for (const MapKind kind : {MapKind::direct, MapKind::global, MapKind::caustic}) {
            const PhotonMap& a = *one.find(kind);
            const PhotonMap& b = *many.find(kind);
            ASSERT_EQ(a.size(), b.size());
            for (std::size_t i = 0; i < a.size(); ++i) {
                ASSERT_EQ(a.positions()[i], b.positions()[i]);
                ASSERT_EQ(a.photons()[i].power, b.photons()[i].power);
            }
        }
        EXPECT_EQ(one.ledger.absorbed, many.ledger.absorbed);
    }
}

TEST(BuildMaps, NoLights_EmptyMaps) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
    const PhotonMaps maps = build(make.build(), 100);
    EXPECT_EQ(maps.find(MapKind::direct)->size(), 0U);
    EXPECT_EQ(maps.ledger.not_emitted, 100U);
    EXPECT_EQ(maps.ledger.imbalance(), 0);
}

TEST(BuildMaps, StoppedByTheMonitor_ReturnsSoon) {
    class Stop final : public Monitor {
        bool stopped() const override { return true; }
    } stop;
    const PhotonMaps maps = build_photon_maps(busy_room(), {100'000'000, kAll, 0, 0}, Workers{2}, stop);
    EXPECT_EQ(maps.ledger.paths, 0U);
}

TEST(Vpls, IntegratingSphere_CarryWhatIsReflected) {
    // Each path reflects the flux Φ ρ/(1-ρ) on average: the sum of π · contribution over all VPLs, per path.
    const float albedo = 0.8F;
    const Scene scene = testing::integrating_sphere(albedo, 10);
    Monitor silent;
    RunningStats stats;
    for (std::uint32_t pass = 0; pass < 50; ++pass) {
        const VplSets sets = build_vpls(scene, {4, 64, 9, pass}, Workers{2}, silent);
        EXPECT_EQ(sets.begins.size(), 5U);
        double sum = 0;
        for (const Vpl& light : sets.lights) sum += static_cast<double>(light.contribution.y * kPi);
        stats.add(sum / (4 * 64));
        EXPECT_LT(sets.ledger.imbalance(), 1e-5);
    }
    EXPECT_TRUE(testing::agrees(stats, 10 * 0.8 / 0.2)) << stats.mean() << " ± " << stats.standard_error();
    // The test detects division by the number of VPLs instead of paths, as printed in [Pharr 2004].
    EXPECT_FALSE(testing::agrees(stats, 10 * 0.8));
}

}  // namespace light_path_test
}  // namespace lucerna
