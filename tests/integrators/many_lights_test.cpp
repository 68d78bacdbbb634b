// Tests that every method chooses among many lights, most of them behind walls, by the light tree, at
// surfaces and in media.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/integrators/integrator.h"
#include "engine/integrators/precomputed_irradiance.h"
#include "tests/support/media.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace many_lights_test {

using testing::SceneMaker;

constexpr int kCells = 32;

// Returns a row of closed cells along x, 1 m each, with a lamp of 0.1 m at every ceiling, and optionally thin
// fog.
Scene cells(float albedo, bool fog) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(albedo)), black = make.diffuse(Rgb(0.0F));
    const V3f x(kCells, 0, 0), y(0, 1, 0), z(0, 0, 1);
    make.quad({0, 0, 0}, z, x, grey);
    make.quad(y, x, z, grey);
    make.quad({0, 0, 0}, x, y, grey);
    make.quad(z, y, x, grey);
    for (int i = 0; i <= kCells; ++i) make.quad({static_cast<float>(i), 0, 0}, y, z, grey);
    for (int i = 0; i < kCells; ++i) {
        const V3f corner(static_cast<float>(i) + 0.45F, 0.98F, 0.45F);
        make.quad_light(corner, {0.1F, 0, 0}, {0, 0, 0.1F}, black, Rgb(10));
    }
    if (fog) {
        const Medium thin = testing::homogeneous(Rgb(0), Rgb(0.05F));
        make.region(testing::in_box(thin, {0, 0, 0}, {kCells, 1, 1}));
    }
    return make.build();
}

// Samples the radiance along a ray to a wall through a cell in the middle of the row.
RunningStats seen(const Scene& scene, const IntegratorSettings& settings) {
    constexpr int kSamples = 4000;
    const Ray ray{{16.2F, 0.5F, 0.1F}, V3f(0.6F, 0.1F, 0.8F).normalized()};
    Monitor silent;
    const Workers workers{2};
    const testing::OnePass estimator(settings, {scene, 7, workers, silent});
    std::vector<double> values(kSamples);
    parallel_ranges(workers, kSamples, 100, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (std::int64_t i = begin; i < end; ++i) {
            Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
            values[static_cast<std::size_t>(i)] = static_cast<double>(estimator.Li(ray, sampler).x);
        }
    });
    RunningStats stats;
    for (const double value : values) stats.add(value);
    return stats;
}

// One sample by power among the 32 equal lamps selects the lamp of its own cell once in 32 times, so its
// variance is at least 31 times the squared mean.
constexpr double kVarianceByPower = kCells - 1;

template <typename Settings>
void expect_lights_chosen_by_the_tree(const Scene& scene, const Settings& settings, const char* name) {
    const RunningStats tree = seen(scene, settings);
    EXPECT_GT(tree.mean(), 0) << name;
    EXPECT_LT(tree.variance(), 0.25 * kVarianceByPower * sqr(tree.mean()))
        << name << ": " << std::sqrt(tree.variance()) / tree.mean();
}

// The lamps nearest to a point are as likely in the neighbouring cells, whose light a wall blocks.
TEST(ManyLights, ChoiceGuidedByPhotons_KeepsTheMeanOfPaths_WithLessNoise) {
    const Scene scene = cells(0.5F, false);
    PathSettings settings;
    const RunningStats plain = seen(scene, settings);
    settings.guide_lights = 20'000;
    const RunningStats guided = seen(scene, settings);
    const double sigma = std::hypot(plain.standard_error(), guided.standard_error());
    EXPECT_LT(std::fabs(guided.mean() - plain.mean()), 4 * sigma);
    EXPECT_GT(std::fabs(1.1 * guided.mean() - plain.mean()), 4 * sigma) << "a tenth more is refused";
    EXPECT_LT(guided.variance(), 0.6 * plain.variance()) << plain.variance();
}

// In the scene with black walls only the fog scatters, so direct light is sampled there alone.
void expect_lights_chosen_by_every_method(const Scene& scene) {
    expect_lights_chosen_by_the_tree(scene, PathSettings{}, "path");
    expect_lights_chosen_by_the_tree(scene, DirectSettings{}, "direct");
    PhotonMapSettings photons;
    photons.photons = 20'000;
    photons.gather_rays = 1;
    expect_lights_chosen_by_the_tree(scene, photons, "photonmap");
    ProgressiveSettings progressive;
    progressive.photons = 20'000;
    expect_lights_chosen_by_the_tree(scene, progressive, "progressive");
    IgiSettings igi;
    igi.nsets = 4;
    expect_lights_chosen_by_the_tree(scene, igi, "igi");
    igi.gather_samples = 1;
    expect_lights_chosen_by_the_tree(scene, igi, "igi, compensated");
}

TEST(ManyLights, FogBetweenBlackWalls_LightsAreChosenByTheTree_UnderEveryMethod) {
    expect_lights_chosen_by_every_method(cells(0, true));
}

// In a scene with scattering media the path tracer samples direct light at surfaces, too.
TEST(ManyLights, WallsInAFoggyScene_ChooseByTheTree) {
    SceneMaker make;
    make.region(testing::in_box(testing::homogeneous(Rgb(0), Rgb(0.01F)), {-9, -9, -9}, {-8, -8, -8}));
    make.quad({0, 0, 0}, {0, 0, 1}, {kCells, 0, 0}, make.diffuse(Rgb(0.5F)));
    const auto black = make.diffuse(Rgb(0.0F));
    for (int i = 0; i < kCells; ++i) {
        make.quad_light({static_cast<float>(i) + 0.45F, 0.3F, 0.45F}, {0.1F, 0, 0}, {0, 0, 0.1F}, black,
                        Rgb(10));
    }
    const Scene scene = make.build();
    ASSERT_FALSE(scene.media().empty());
    Monitor silent;
    const Workers workers{1};
    const testing::OnePass estimator(PathSettings{}, {scene, 7, workers, silent});
    RunningStats tree;
    for (std::uint64_t i = 0; i < 4000; ++i) {
        Sampler sampler(7, Purpose::test, 0, i);
        tree.add(static_cast<double>(
            estimator.Li({{16.5F, 0.2F, 0.5F}, V3f(0.1F, -1, 0.1F).normalized()}, sampler).x));
    }
    EXPECT_GT(tree.mean(), 0);
    EXPECT_LT(tree.variance(), 0.25 * kVarianceByPower * sqr(tree.mean()));
}

// --- precomputed irradiance

// Errors of precomputed irradiance do not average out however many samples the image has: a point that
// sampled the lamps of other cells is a blot. The mean of four draws by power among 32 lamps has a relative
// standard deviation of sqrt(31/4) = 2.8.
TEST(ManyLights, PrecomputedIrradiance_ChoosesByTheTree) {
    const Scene scene = cells(0.4F, false);
    PhotonMapSettings settings;
    settings.precompute = 1;
    DensityEstimateSettings how;
    how.k = 50;
    how.radius = 0.3F;
    Monitor silent;
    const Workers workers{2};
    RunningStats places;
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
        MapParameters parameters;
        parameters.paths = 6000;
        parameters.seed = seed;
        parameters.wanted[static_cast<std::size_t>(MapKind::global)] = true;
        const PhotonMaps maps = build_photon_maps(scene, parameters, workers, silent);
        PassStatistics statistics;
        const PassContext context{{scene, seed, workers, silent}, 0, statistics};
        const IrradiancePoints points = precompute_irradiance(context, maps, how, settings);
        for (int cell = 8; cell < 24; ++cell) {
            for (const float dx : {0.3F, 0.5F, 0.7F}) {
                const V3f x(static_cast<float>(cell) + dx, 0, 0.5F);
                if (const auto found = points.nearest(x, {0, 1, 0}, how.radius))
                    places.add(static_cast<double>(found->irradiance.x));
            }
        }
    }
    EXPECT_GT(places.count(), 8 * 24U);
    EXPECT_LT(std::sqrt(places.variance()), 0.7 * places.mean());
    RecordProperty("spread", fmt::format("{:.3f}", std::sqrt(places.variance()) / places.mean()));
}

}  // namespace many_lights_test
}  // namespace lucerna
