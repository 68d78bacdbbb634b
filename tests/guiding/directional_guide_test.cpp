// Tests directions guided by photons: their density, their effect on path and photonmap, and where they are
// not used.
#include "engine/guiding/directional_guide.h"

#include <gtest/gtest.h>

#include <numeric>

#include "engine/base/warp.h"
#include "engine/integrators/integrator.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace directional_guide_test {

using testing::OnePass;
using testing::SceneMaker;

constexpr std::size_t kSide = SquareHistogram::kSide, kCells = SquareHistogram::kCells;

std::array<float, kCells> uneven_weights() {
    std::array<float, kCells> weights;
    for (std::size_t i = 0; i < kCells; ++i) weights[i] = 0.2F + static_cast<float>((i * 37) % 101) / 25;
    weights[77] = 60;
    return weights;
}

V2f centre(std::size_t i) {
    return {(static_cast<float>(i % kSide) + 0.5F) / kSide, (static_cast<float>(i / kSide) + 0.5F) / kSide};
}

TEST(DirectionGuide, Square_WarpedToDiscAndBack_IsItself) {
    Sampler sampler(1, Purpose::test, 0, 0);
    for (int i = 0; i < 10'000; ++i) {
        const V2f u = sampler.next2(), back = disc_to_square(square_to_disc(u));
        EXPECT_NEAR(u.x, back.x, 2e-6F);
        EXPECT_NEAR(u.y, back.y, 2e-6F);
    }
}

TEST(DirectionGuide, Density_IntegratesToOne_AndIsThatOfItsSamples) {
    const auto weights = uneven_weights();
    const SquareHistogram histogram{std::span<const float, kCells>(weights)};
    std::vector<double> expected(kCells);
    double sum = 0;
    constexpr int kDraws = 200'000;
    for (std::size_t i = 0; i < kCells; ++i) {
        const double share = double{histogram.density(centre(i))} / kCells;
        sum += share;
        expected[i] = share * kDraws;
    }
    EXPECT_NEAR(sum, 1, 1e-6);

    std::vector<std::uint64_t> observed(kCells);
    Sampler sampler(2, Purpose::test, 0, 0);
    for (int i = 0; i < kDraws; ++i) {
        const V2f at = histogram.warp(sampler.next2());
        ++observed[static_cast<std::size_t>(at.y * kSide) * kSide + static_cast<std::size_t>(at.x * kSide)];
    }
    EXPECT_TRUE(testing::chi_square(observed, expected).accepted());

    // The test detects exchanged rows and columns.
    std::vector<double> wrong(kCells);
    for (std::size_t i = 0; i < kCells; ++i) wrong[i] = expected[i % kSide * kSide + i / kSide];
    EXPECT_FALSE(testing::chi_square(observed, wrong).accepted());
}

TEST(DirectionGuide, MixedWithABsdf_ItsDensityIsThatOfItsSamples_ByTheIntegralOfAPolynomial) {
    const auto weights = uneven_weights();
    const SquareHistogram histogram{std::span<const float, kCells>(weights)};
    const V3f ns = V3f(0.2F, 0.1F, 1).normalized(), n(0, 0, 1), wo = V3f(0.3F, -0.4F, 0.8F).normalized();
    const Bsdf bsdf(DiffuseLobe{Rgb(0.7F)}, ns, n, {1, 0, 0});
    const GuidedBsdf guided(bsdf, wo, DirectionGuide(histogram, Frame(n), ns));
    // The mean weight is the integral of f cos, whatever the density.
    RunningStats of_guided, of_bsdf, of_wrong;
    for (std::uint64_t i = 0; i < 200'000; ++i) {
        Sampler sampler(3, Purpose::test, 0, i);
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto value = [](const V3f& wi) { return 1.0 + double{wi.x} - 0.5 * double{wi.y * wi.z}; };
        const auto a = guided.sample(u);
        const auto b = bsdf.sample(wo, u, Transport::radiance);
        of_guided.add(a ? double{a->sample.weight.x} * value(a->sample.wi) : 0);
        of_wrong.add(a ? double{a->sample.weight.x} * double{a->ratio} * value(a->sample.wi) : 0);
        of_bsdf.add(b ? double{b->weight.x} * value(b->wi) : 0);
    }
    const auto sigmas = [&](const RunningStats& ours) {
        return std::fabs(ours.mean() - of_bsdf.mean()) /
               std::hypot(ours.standard_error(), of_bsdf.standard_error());
    };
    EXPECT_LT(sigmas(of_guided), 4);
    EXPECT_GT(sigmas(of_wrong), 8) << "the BSDF's own density in place of the mixture's is refused";
}

// Returns two rooms, one with a lamp, joined by a small opening in the wall between them: all light in the
// other one comes through it.
Scene lit_through_an_opening(bool glass) {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.7F));
    make.room({3, 1, 1}, white);
    const auto wall = [&](float x) {
        make.quad({x, 0, 0}, {0, 0.8F, 0}, {0, 0, 1}, white);
        make.quad({x, 0.8F, 0}, {0, 0.2F, 0}, {0, 0, 0.8F}, white);
    };
    wall(1.5F);
    if (glass) make.sphere({0.6F, 0.3F, 0.5F}, 0.2F, make.material(DielectricMaterial{}));
    make.quad_light({2.2F, 0.98F, 0.4F}, {0.3F, 0, 0}, {0, 0, 0.3F}, make.diffuse(Rgb(0)), Rgb(9, 8, 7));
    return make.build();
}

Scene directly_lit_plane() {
    SceneMaker make;
    make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, make.diffuse(Rgb(0.8F)));
    make.quad_light({-0.2F, 1, -0.2F}, {0.4F, 0, 0}, {0, 0, 0.4F}, make.diffuse(Rgb(0)), Rgb(5));
    return make.build();
}

PathSettings path(std::int64_t guide_paths) {
    PathSettings settings;
    settings.guide_paths = guide_paths;
    settings.max_depth = 6;
    return settings;
}
// Guided: the pilot of the view decides on gather rays, and guides them here; otherwise a fixed number of
// gather rays, which are not guided.
PhotonMapSettings photon_map(bool guided) {
    PhotonMapSettings settings;
    settings.photons = 50'000;
    settings.gather_rays = guided ? 0 : 2;
    return settings;
}

// Samples the radiance along a ray from the middle of the dark room to its floor, which receives no direct
// light.
RunningStats radiance(const Scene& scene, const IntegratorSettings& settings, std::uint64_t seed,
                      std::uint64_t count, const Workers& workers = {}) {
    Monitor silent;
    const Camera camera = testing::camera({0.4F, 0.55F, 0.1F}, {0.4F, 0, 0.11F}, 16, 16, 10);
    const OnePass pass(settings, {scene, 5, workers, silent, View{&camera, V2f(0.0F), V2f(16.0F)}});
    RunningStats stats;
    for (std::uint64_t i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 1, i);
        stats.add(double{luminance(pass.Li({{0.4F, 0.55F, 0.1F}, {0, -1, 0}}, sampler))});
    }
    return stats;
}

double sigmas_apart(const RunningStats& a, const RunningStats& b, double scale = 1) {
    return std::fabs(scale * a.mean() - b.mean()) /
           std::hypot(scale * a.standard_error(), b.standard_error());
}

TEST(DirectionGuide, Path_ThroughAnOpening_KeepsItsMean) {
    const Scene scene = lit_through_an_opening(false);
    const RunningStats plain = radiance(scene, path(0), 1, 150'000);
    const RunningStats guided = radiance(scene, path(50'000), 2, 150'000);
    EXPECT_LT(sigmas_apart(guided, plain), 4);
    EXPECT_GT(sigmas_apart(guided, plain, 1.25), 4) << "a weight that is wrong by a quarter is refused";
}

// Returns a dark room lit by one bright patch at its ceiling.
Scene lit_by_a_patch() {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.2F)));
    make.quad_light({0.47F, 0.94F, 0.47F}, {0, 0, 0.06F}, {0.06F, 0, 0}, make.diffuse(Rgb(0)), Rgb(90));
    return make.build();
}

TEST(DirectionGuide, WhereOnePatchLightsARoom_VarianceFalls) {
    const Scene scene = lit_by_a_patch();
    const RunningStats plain = radiance(scene, path(0), 1, 50'000);
    const RunningStats guided = radiance(scene, path(50'000), 2, 50'000);
    EXPECT_LT(sigmas_apart(guided, plain), 4);
    EXPECT_LT(guided.variance(), 0.5 * plain.variance()) << plain.variance();
}

TEST(DirectionGuide, PathAndPhotonMap_WithGlass_KeepTheirMeans) {
    const Scene scene = lit_through_an_opening(true);
    EXPECT_LT(sigmas_apart(radiance(scene, path(50'000), 1, 100'000), radiance(scene, path(0), 2, 100'000)),
              4);
    const RunningStats plain = radiance(scene, photon_map(false), 1, 20'000);
    const RunningStats guided = radiance(scene, photon_map(true), 2, 20'000);
    EXPECT_LT(sigmas_apart(guided, plain), 4);
    EXPECT_GT(sigmas_apart(guided, plain, 1.25), 4);
}

TEST(DirectionGuide, Radiance_OnOneTwoAndThreeThreads_IsTheSame) {
    const Scene scene = lit_through_an_opening(true);
    for (const IntegratorSettings& settings :
         {IntegratorSettings(path(20'000)), IntegratorSettings(photon_map(true))}) {
        const double one = radiance(scene, settings, 1, 500, Workers{1}).mean();
        EXPECT_EQ(one, radiance(scene, settings, 1, 500, Workers{2}).mean());
        EXPECT_EQ(one, radiance(scene, settings, 1, 500, Workers{3}).mean());
    }
}

TEST(DirectionGuide, OverADirectlyLitPlane_IsLeftAlone) {
    const Scene scene = directly_lit_plane();
    Monitor silent;
    DirectionGuideParameters parameters;
    parameters.paths = 20'000;
    const DirectionGuideMap guides = build_direction_guides(scene, parameters, Workers{2}, silent);
    const Bsdf floor(DiffuseLobe{Rgb(0.8F)}, {0, 1, 0}, {0, 1, 0}, {1, 0, 0});
    EXPECT_TRUE(guides.at({0.4F, 0, 0.1F}, floor, {0, 1, 0}).empty());
    EXPECT_EQ(radiance(scene, path(20'000), 1, 500).mean(), radiance(scene, path(0), 1, 500).mean());
}

}  // namespace directional_guide_test
}  // namespace lucerna
