// The choice of planes for a ray set, their resolution, and the noise that remains.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numeric>

#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/measurement/held_out.h"
#include "lights/measurement/ray_projection.h"
#include "tests/lights/field_fixtures.h"

namespace lucerna {
namespace ray_fit_test {

// Returns rays with a cos^n lobe through a square of light at height z = `waist` that start at height
// `start`.
RaySet bundle(double half, double waist, double start, double exponent, int count, std::uint64_t seed) {
    RaySet set;
    set.flux = 100;
    set.unit = FluxUnit::lumen;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f a = sampler.next2(), b = sampler.next2();
        const double z = std::pow(1 - double{b.x}, 1 / (exponent + 1)), r = std::sqrt(1 - z * z);
        const double turn = 2 * M_PI * double{b.y};
        const V3d d(r * std::cos(turn), r * std::sin(turn), z);
        const V3d o = V3d(half * (2 * double{a.x} - 1), half * (2 * double{a.y} - 1), waist) +
                      d * ((start - waist) / z);
        set.rays.push_back({V3f(o), V3f(d), static_cast<float>(set.flux / count)});
    }
    return set;
}

TEST(Waist, OfABundle_IsWhereItsLinesAreClosest) {
    for (const double waist : {-0.03, 0.0, 0.02}) {
        const RaySet set = bundle(0.001, waist, 0.005, 3, 20000, 11);
        const Waist found = waist_of(set);
        // The mean slope of this many rays is off by 1/√N of its spread, and so is the height, in units of
        // the square's size.
        EXPECT_NEAR(found.z, waist, 1e-4);
        EXPECT_NEAR(found.spread, 0.001 * std::sqrt(2.0 / 3), 5e-5);  // of a square of half size 1 mm
    }
}

TEST(Waist, ParallelRays_IsWhereTheyStart) {
    RaySet set;
    set.flux = 2;
    set.rays = {{{0, 0, 1}, {0, 0, 1}, 1}, {{1, 0, 3}, {0, 0, 1}, 1}};
    EXPECT_NEAR(waist_of(set).z, 2, 1e-12);
}

TEST(ChoosePlanes, Long_S_StandsAtTheWaistButNotBehindWhatEmits) {
    Monitor silent;
    // The plane goes to a waist in front of the lamp, and to the lamp's front if the waist lies behind it (a
    // virtual focus).
    EXPECT_NEAR(choose_planes(bundle(0.001, 0.02, 0, 50, 20000, 12), {}, {}, silent).rig.centre.z, 0.02,
                1e-3);
    EXPECT_NEAR(choose_planes(bundle(0.001, -0.001, 0, 2, 20000, 13), {}, {}, silent).rig.centre.z, 0, 1e-6);
    // Rays that start on a distant surface around the lamp do not tell where it ends, so the plane goes to
    // the waist.
    EXPECT_NEAR(choose_planes(bundle(0.001, 0, 0.3, 5, 20000, 14), {}, {}, silent).rig.centre.z, 0, 1e-4);
}

TEST(ChoosePlanes, Long_MoreRays_MakeAFieldOfLessError) {
    Monitor silent;
    double error = INFINITY;
    for (const int count : {2000, 20000, 200000}) {
        const RayPlanes planes = choose_planes(bundle(0.002, 0, 0, 2, count, 15), {}, {}, silent);
        EXPECT_LT(total_error(planes.errors), 0.5 * error) << count;
        error = total_error(planes.errors);
    }
}

// The error stated for a field from its own rays must be the error that two million other rays find.
TEST(ChoosePlanes, Long_ErrorStated_IsWhatFreshRaysFind) {
    Monitor silent;
    const RaySet fresh = bundle(0.002, 0, 0, 1, 2'000'000, 39);
    std::vector<std::size_t> all(fresh.rays.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    RunningStats stated, found;
    for (std::uint64_t seed = 40; seed < 44; ++seed) {
        const Projection p = fit_light_field(bundle(0.002, 0, 0, 1, 20000, seed), {}, {}, silent);
        const HeldOutRays judge(fresh, all, all.size(), p.field.rig().centre.z, 400'000);
        for (const PlaneError& e : p.field.info().errors) stated.add(e.squared);
        for (const PlaneError& e : judge.errors(p.field)) found.add(e.squared);
        std::cout << "stated " << std::sqrt(stated.mean()) << ", found " << std::sqrt(found.mean()) << "\n";
    }
    // The least of many estimates is biased slightly low.
    EXPECT_NEAR(std::sqrt(stated.mean() / found.mean()), 1, 0.25);
}

TEST(ChoosePlanes, VeryFewRays_MakeAFieldAllTheSame) {
    Monitor silent;
    const Projection p = fit_light_field(bundle(0.002, 0, 0, 2, 50, 16), {}, {}, silent);
    EXPECT_LE(p.field.rig().coefficients(), 2500U);
    EXPECT_NEAR(p.account.captured, 100, 1);
}

TEST(ProjectRays, NoisePredicted_IsWhatRepetitionsDifferBy) {
    Monitor silent;
    for (const int resolution : {5, 12}) {
        const auto repetition = [](std::uint64_t i) { return bundle(0.002, 0, 0, 2, 40000, 30 + i); };
        Rig rig;
        rig.views = rig.pixels = {resolution, resolution};
        rig.spacing = V2d(0.004 / (resolution - 3));
        rig.distance = 0.02;
        rig.pixel = V2d(0.12 / resolution);
        const double predicted = project_rays(repetition(0), rig, {}, silent).noise;
        // For independent repetitions the difference of two has twice the variance of one, and the mean
        // square of the two adds the signal once more.
        double difference = 0, square = 0;
        constexpr int kPairs = 6;
        for (std::uint64_t pair = 0; pair < kPairs; ++pair) {
            const LightField a = project_rays(repetition(2 * pair), rig, {}, silent).field;
            const LightField b = project_rays(repetition(2 * pair + 1), rig, {}, silent).field;
            for (std::size_t i = 0; i < a.coefficients().size(); ++i) {
                const double x = double{a.coefficients()[i]}, y = double{b.coefficients()[i]};
                difference += sqr(x - y) / 2;
                square += 0.5 * (x * x + y * y);
            }
        }
        const double measured = std::sqrt(difference / (square - difference));
        std::cout << "noise predicted " << predicted << ", measured " << measured << "\n";
        // With some hundred coefficients times six pairs, 7 % is three standard errors of the ratio. A
        // prediction without the duals' norm (a factor of 1.37), or none at all, is far outside.
        EXPECT_NEAR(measured / predicted, 1, 0.07) << resolution;
    }
}

}  // namespace ray_fit_test
}  // namespace lucerna
