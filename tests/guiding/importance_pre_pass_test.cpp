// Tests importance pre-passes: where images look up photons, the emission that results, and that it preserves
// all means.
#include "engine/guiding/importance_pre_pass.h"

#include <gtest/gtest.h>

#include "photon/build_maps.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/two_rooms.h"

namespace lucerna {
namespace importance_pre_pass_test {

using testing::left_camera;
using testing::SceneMaker;
using testing::two_rooms;

constexpr std::array kSurfaceMaps{MapKind::direct, MapKind::caustic, MapKind::global};

View all_of(const Camera& camera) {
    return {&camera, V2f(0.0F), V2f(32.0F)};
}

ImportancePrePassSettings pre_pass_settings(std::int64_t paths = 8192) {
    ImportancePrePassSettings settings;
    settings.paths = paths;
    settings.seed = 4;
    for (const MapKind kind : kSurfaceMaps) settings.seen[static_cast<std::size_t>(kind)] = true;
    settings.estimate.k = 16;
    settings.estimate.radius = 0.1F;
    return settings;
}

ImportancePrePass pre_pass_of(const Scene& scene, const ImportancePrePassSettings& settings,
                              const Workers& workers = {2}) {
    const Camera camera = left_camera();
    Monitor silent;
    return run_importance_pre_pass(scene, all_of(camera), settings, workers, silent).value();
}

TEST(Importons, LieWhereTheCameraLooks_AndGatherRaysLand) {
    const Scene scene = two_rooms(false);
    const Camera camera = left_camera();
    for (const bool gather : {false, true}) {
        ImportonParameters parameters;
        parameters.rays = 2000;
        parameters.gather = gather;
        std::size_t at_gather = 0;
        const auto importons = trace_importons(scene, all_of(camera), parameters, {2});
        EXPECT_GT(importons.size(), 1800U);  // some rays are lost in glass, or meet the lamp
        for (const Importon& importon : importons) {
            EXPECT_LE(importon.p.x, 1.0001F);
            EXPECT_GT(importon.weight, 0);
            EXPECT_LE(importon.weight, 1.01F * kInvPi);
            EXPECT_NEAR(importon.n.length(), 1, 1e-5F);
            EXPECT_LT(importon.ray, 2000U);
            at_gather += importon.at_gather ? 1 : 0;
        }
        EXPECT_EQ(at_gather > 0, gather);
    }
}

TEST(ImportancePrePass, ALightThatNobodySees_IsEmittedAtTheDefensiveWeight) {
    const Scene scene = two_rooms(false);
    const ImportancePrePass pre_pass = pre_pass_of(scene, pre_pass_settings());
    EXPECT_GE(pre_pass.emission.probability(1), 0.25 * 0.5 * (1 - 1e-5));
    EXPECT_LE(pre_pass.emission.probability(1), 0.25 * 0.5 + 0.02);
    std::size_t unseen = 0;
    constexpr std::uint32_t kPaths = 1 << 14;
    Emission emission(scene, 1, Purpose::emission, 0, &pre_pass.emission);
    emission.for_each(0, kPaths, [&](std::uint32_t, const std::optional<LightPathStart>& start) {
        ASSERT_TRUE(start);
        unseen += start->light;
    });
    EXPECT_NEAR(static_cast<double>(unseen), kPaths * pre_pass.emission.probability(1), 3);
    // Through a passage part of its light is seen, and much of it is still not.
    const ImportancePrePass through = pre_pass_of(two_rooms(true), pre_pass_settings());
    EXPECT_GT(through.emission.probability(1), pre_pass.emission.probability(1) + 0.02);
    EXPECT_LT(through.emission.probability(1), 0.45);
}

TEST(ImportancePrePass, OnAnyNumberOfThreads_LearnsTheSame) {
    const Scene scene = two_rooms(true);
    ImportancePrePassSettings settings = pre_pass_settings();
    settings.gather = true;
    settings.at_gather = settings.seen;
    EXPECT_EQ(pre_pass_of(scene, settings, {1}).emission.hash(),
              pre_pass_of(scene, settings, {3}).emission.hash());
}

TEST(ImportancePrePass, WithoutLightsOrSurfaces_IsNone) {
    const Camera camera = left_camera();
    Monitor silent;
    SceneMaker dark;
    dark.room({1, 1, 1}, dark.diffuse(Rgb(0.5F)));
    EXPECT_FALSE(run_importance_pre_pass(dark.build(), all_of(camera), pre_pass_settings(), {1}, silent));
    SceneMaker empty;
    empty.light(make_point_light(V3f(0.0F), Rgb(1.0F)));
    EXPECT_FALSE(run_importance_pre_pass(empty.build(), all_of(camera), pre_pass_settings(), {1}, silent));
}

// The camera sees one plate, and the lamps light another one far away.
TEST(ImportancePrePass, NoPhotonNearAnImporton_LearnsPlainEmission) {
    SceneMaker apart;
    apart.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, apart.diffuse(Rgb(0.5F)));
    apart.quad({90, 90, 0}, {0, 0, 1}, {1, 0, 0}, apart.diffuse(Rgb(0.5F)));
    apart.light(make_spot_light({90.5F, 90.5F, 0.5F}, {90.5F, 90, 0.5F}, Rgb(1), {20, 20}));
    apart.light(make_spot_light({90.5F, 90.6F, 0.5F}, {90.5F, 90, 0.5F}, Rgb(3), {20, 20}));
    const Scene scene = apart.build();
    const Camera down = testing::camera({0.5F, 1, 0.5F}, {0.5F, 0, 0.51F}, 32, 32, 40);
    Monitor silent;
    const auto pre_pass = run_importance_pre_pass(scene, all_of(down), pre_pass_settings(), {1}, silent);
    ASSERT_TRUE(pre_pass);
    EXPECT_GT(pre_pass->importons, 0U);
    EXPECT_EQ(pre_pass->useful, 0);
    EXPECT_NEAR(pre_pass->emission.probability(0), 0.25, 1e-6);
    EXPECT_NEAR(pre_pass->emission.probability(1), 0.75, 1e-6);
}

// The light of each map within the left room, over independent passes.
struct Arrived {
    std::array<RunningStats, kMapKinds> weighted, unweighted;
};

Arrived arrived(const Scene& scene, const LearnedEmission* learned, std::uint32_t passes) {
    Arrived result;
    Monitor silent;
    double flux = 0;
    for (const auto& light : scene.lights()) flux += light->power();
    MapParameters maps;
    maps.paths = 4096;
    maps.seed = 21;
    maps.emission = learned;
    for (const MapKind kind : kSurfaceMaps) maps.wanted[static_cast<std::size_t>(kind)] = true;
    for (std::uint32_t pass = 0; pass < passes; ++pass) {
        maps.pass = pass + (learned ? 1000 : 0);
        const PhotonMaps built = build_photon_maps(scene, maps, {2}, silent);
        for (const MapKind kind : kSurfaceMaps) {
            const auto k = static_cast<std::size_t>(kind);
            const PhotonMap& map = *built.find(kind);
            double power = 0, count = 0;
            for (std::size_t i = 0; i < map.size(); ++i) {
                if (!(map.positions()[i].x < 1)) continue;
                power += double{luminance(map.photons()[i].power)};
                ++count;
            }
            result.weighted[k].add(power);
            result.unweighted[k].add(count * flux / static_cast<double>(maps.paths));
        }
    }
    return result;
}

bool agree(const RunningStats& a, const RunningStats& b) {
    const double error = std::hypot(a.standard_error(), b.standard_error());
    return std::fabs(a.mean() - b.mean()) < 4 * error;
}

// All three maps have the mean of plain emission (4 sigmas); without the weights they have not.
TEST(ImportancePrePass, SteeredMaps_HoldTheSameLight_AndTheTestSeesWrongWeights) {
    const Scene scene = two_rooms(true);
    const ImportancePrePass pre_pass = pre_pass_of(scene, pre_pass_settings());
    const Arrived plain = arrived(scene, nullptr, 80), steered = arrived(scene, &pre_pass.emission, 80);
    for (const MapKind kind : kSurfaceMaps) {
        const auto k = static_cast<std::size_t>(kind);
        EXPECT_TRUE(agree(plain.weighted[k], steered.weighted[k]))
            << map_name(kind) << ": " << plain.weighted[k].mean() << " and " << steered.weighted[k].mean();
        EXPECT_FALSE(agree(plain.weighted[k], steered.unweighted[k])) << map_name(kind);
    }
}

// Steering reduces the variance of the radiance that the camera sees in the maps, for as many paths. A lamp
// that matters gets 7/8 of the paths instead of half, so the variance can fall to 4/7 at best.
TEST(ImportancePrePass, SteeredEstimates_HaveLessVariance) {
    const Scene scene = two_rooms(false);
    const ImportancePrePass pre_pass = pre_pass_of(scene, pre_pass_settings());
    const Camera camera = left_camera();
    ImportonParameters looks;
    looks.rays = 100;
    looks.seed = 77;
    const auto places = trace_importons(scene, all_of(camera), looks, {1});
    Monitor silent;
    const auto mean_relative_variance = [&](const LearnedEmission* learned) {
        std::vector<RunningStats> seen(places.size());
        MapParameters maps;
        maps.paths = 4096;
        maps.seed = 33;
        maps.emission = learned;
        maps.wanted[static_cast<std::size_t>(MapKind::global)] = true;
        DensityEstimateSettings how;
        how.k = 0;
        how.radius = 0.1F;
        for (maps.pass = 0; maps.pass < 60; ++maps.pass) {
            const PhotonMaps built = build_photon_maps(scene, maps, {2}, silent);
            const DensityEstimate density(*built.find(MapKind::global), how);
            for (std::size_t i = 0; i < places.size(); ++i) {
                seen[i].add(double{luminance(density.irradiance({places[i].p, places[i].n, 0}).value)});
            }
        }
        double sum = 0;
        for (const RunningStats& stats : seen) sum += stats.variance() / (stats.mean() * stats.mean());
        return sum / static_cast<double>(seen.size());
    };
    const double plain = mean_relative_variance(nullptr),
                 steered = mean_relative_variance(&pre_pass.emission);
    RecordProperty("plain_over_steered", std::to_string(plain / steered));
    EXPECT_LT(steered, 0.75 * plain);
}

}  // namespace importance_pre_pass_test
}  // namespace lucerna
