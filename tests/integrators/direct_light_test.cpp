// Tests direct light at one point: its value against the closed form, and the number of rays spent on it.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/transport/direct_light.h"
#include "tests/support/closed_forms.h"
#include "tests/support/eye_paths.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace direct_light_test {

using testing::SceneMaker;

constexpr int kSamples = 100'000;
constexpr float kAlbedo = 0.6F, kRadiance = 5;
constexpr float kSky = 6e-4F;  // about as powerful as the lamp, so drawn about as often

// Return the corners of a lamp of 0.2 by 0.2 at the given height, and a scene with that lamp above a floor.
std::vector<V3d> corners(float height) {
    return {{-0.1, -0.1, height}, {-0.1, 0.1, height}, {0.1, 0.1, height}, {0.1, -0.1, height}};
}
Scene lamp_above_floor(float height, bool sky) {
    SceneMaker make;
    make.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, make.diffuse(Rgb(kAlbedo)));
    make.quad_light({-0.1F, -0.1F, height}, {0, 0.2F, 0}, {0.2F, 0, 0}, make.diffuse(Rgb(0.0F)),
                    Rgb(kRadiance));
    if (sky) make.light(make_infinite_light(Rgb(kSky), {V3f(0.0F), 10}));
    return make.build();
}
// Returns the radiance reflected at the floor's origin, where nothing but the lamp hides the sky.
double expected(float height, bool sky) {
    const double lamp = testing::contour_irradiance(corners(height), V3d(0.0), V3d(0, 0, 1));
    return kAlbedo / double{kPi} * (lamp * kRadiance + (sky ? (double{kPi} - lamp) * kSky : 0));
}

struct Lit {
    RunningStats radiance;
    double rays;  // per sample
};
Lit lit(float height, bool sky) {
    const Scene scene = lamp_above_floor(height, sky);
    const Ray ray{{0.3F, 0, 0.02F}, V3f(-0.3F, 0, -0.02F).normalized()};
    const auto hit = scene.intersect(ray);
    const Bsdf bsdf = scene.bsdf(*hit);
    const Vertex vertex{*hit, bsdf, -ray.d};
    const auto before = scene.rays();
    Lit result;
    for (std::uint32_t i = 0; i < kSamples; ++i) {
        Sampler sampler = Sampler::stratified(9, Purpose::test, 0, i);
        result.radiance.add(double{luminance(testing::direct_radiance(scene, vertex, sampler))});
    }
    result.rays = static_cast<double>(scene.rays() - before) / kSamples;
    return result;
}

// Six comparisons at 4 sigmas: false alarms below 4e-4.
TEST(DirectLight, FromLampsNearAndFar_IsTheContourIntegral) {
    for (const bool sky : {false, true}) {
        for (const float height : {0.1F, 0.5F, 3.0F}) {
            const Lit found = lit(height, sky);
            const double truth = expected(height, sky);
            EXPECT_TRUE(testing::agrees(found.radiance, truth))
                << height << ": " << found.radiance.mean() << " +- " << found.radiance.standard_error()
                << " for " << truth;
            EXPECT_FALSE(testing::agrees(found.radiance, 1.03 * truth)) << height;
        }
    }
}

// Compares a floor under a sky with and without a sun: every sample differs by exactly the sun's
// contribution.
TEST(DirectLight, OfASunBesideASky_IsTheSameInEverySample) {
    constexpr float kSun = 2;
    const auto floor = [&](bool sun, bool roof) {
        SceneMaker make;
        make.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, make.diffuse(Rgb(kAlbedo)));
        if (roof) make.quad({-1, -1, 1}, {2, 0, 0}, {0, 2, 0}, make.diffuse(Rgb(kAlbedo)));
        make.light(make_infinite_light(Rgb(kRadiance), {V3f(0.0F), 10}));
        if (sun) make.light(make_distant_light({0, 0.6F, -0.8F}, Rgb(kSun), {V3f(0.0F), 10}));
        return make.build();
    };
    const double from_sun = double{kAlbedo} / double{kPi} * double{kSun} * 0.8;
    const auto sample = [&](const Scene& scene, std::uint32_t i) {
        const Ray ray{{0.3F, 0, 0.02F}, V3f(-0.3F, 0, -0.02F).normalized()};
        const auto hit = scene.intersect(ray);
        const Bsdf bsdf = scene.bsdf(*hit);
        const Vertex vertex{*hit, bsdf, -ray.d};
        Sampler sampler = Sampler::stratified(9, Purpose::test, 0, i);
        const LightChoice choice = LightChooser(scene).at(hit->at, bsdf, -ray.d);
        return double{luminance(testing::direct_radiance(scene, vertex, sampler, choice))};
    };
    const Scene sky = floor(false, false), both = floor(true, false);
    const Scene shaded_sky = floor(false, true), shaded = floor(true, true);
    for (std::uint32_t i = 0; i < 200; ++i) {
        EXPECT_NEAR(sample(both, i) - sample(sky, i), from_sun, 1e-5 * from_sun) << i;
        EXPECT_EQ(sample(shaded, i), sample(shaded_sky, i)) << i;
    }
}

TEST(DirectLight, OfASmallLamp_TakesLittleMoreThanItsOwnRay) {
    // Nearby, the lamp covers a third of the hemisphere, and both strategies are needed.
    EXPECT_GT(lit(0.1F, false).rays, 1.8);
    EXPECT_LT(lit(3, false).rays, 1.3);
    // A sky is sampled through the BSDF, whatever lamps there are besides.
    EXPECT_GT(lit(3, true).rays, 1.6);
}

}  // namespace direct_light_test
}  // namespace lucerna
