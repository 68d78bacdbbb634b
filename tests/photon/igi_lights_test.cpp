// Virtual lights as sets of light paths leave them: lights chosen by power in every set, equal strength along
// a path, the energy of all bounces, and an end even where nothing absorbs [igi 1, 2].
#include <gtest/gtest.h>

#include "photon/virtual_lights.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

using testing::SceneMaker;

VirtualLightSets lights_of(const Scene& scene, std::uint32_t sets, std::uint32_t paths) {
    Monitor silent;
    VirtualLightPlan plan;
    plan.sets = sets;
    plan.paths = paths;
    plan.seed = 5;
    return build_virtual_lights(scene, plan, Workers{2}, silent);
}

Scene room_of(const Rgb& albedo, float intensity = 1) {
    SceneMaker make;
    make.room({1, 2, 1}, make.diffuse(albedo));
    make.light(make_point_light(V3f(0.5F, 1, 0.5F), Rgb(intensity)));
    return make.build();
}

TEST(VirtualLightStarts, InEverySet_AreSharedOutByPower) {
    SceneMaker make;
    make.light(make_point_light(V3f(0.0F), Rgb(5)));
    make.light(make_point_light(V3f(1.0F), Rgb(2)));
    make.light(make_point_light(V3f(2.0F), Rgb(1)));
    const Scene scene = make.build();
    constexpr std::uint32_t kPaths = 32, kSets = 64;
    Emission emission(scene, 5, Purpose::virtual_light, 0);
    std::array<double, 3> all{};
    for (std::uint32_t set = 0; set < kSets; ++set) {
        std::array<double, 3> count{};
        emission.for_each(set * kPaths, (set + 1) * kPaths,
                          [&](std::uint32_t, const std::optional<LightPathStart>& start) {
                              ASSERT_TRUE(start);
                              ++count[start->light];
                          });
        for (std::size_t i = 0; i < 3; ++i) {
            all[i] += count[i];
            // A light's part of the line is cut at two places by a set's 32 equal steps.
            EXPECT_LT(
                std::fabs(count[i] - kPaths * scene.lights()[i]->power() / scene.picker().total_power()), 2)
                << "set " << set << ", light " << i;
        }
    }
    for (std::size_t i = 0; i < 3; ++i) {
        const double expected = kPaths * kSets * scene.lights()[i]->power() / scene.picker().total_power();
        EXPECT_LT(std::fabs(all[i] - expected), 2) << "all sets together, light " << i;
    }
}

TEST(VirtualLights, OfGreyWalls_AreAllOfOneStrength) {
    for (const float albedo : {0.2F, 0.5F, 0.9F}) {
        const VirtualLightSets sets = lights_of(room_of(Rgb(albedo)), 4, 64);
        ASSERT_GT(sets.lights.size(), 200U);
        for (const VirtualLight& light : sets.lights) {
            EXPECT_NEAR(luminance(light.contribution) / (4 * kPi * albedo * kInvPi), 1, 1e-3F);
        }
    }
}

// However colourful the walls: the luminance that arrives is the start's.
TEST(VirtualLights, OfColourfulWalls_ComeFromPowersOfOneLuminance) {
    const Rgb albedo(0.9F, 0.3F, 0.05F);
    const VirtualLightSets sets = lights_of(room_of(albedo), 4, 64);
    float reddest = 0;
    for (const VirtualLight& light : sets.lights) {
        const Rgb arrived = light.contribution / albedo * kPi;
        EXPECT_NEAR(luminance(arrived) / (4 * kPi), 1, 2e-3F);
        reddest = std::max(reddest, arrived.x / arrived.y);
    }
    EXPECT_GT(reddest, 10);
}

// Over all bounces walls scatter Φ ρ/(1 - ρ).
TEST(VirtualLights, Together_ScatterTheSeriesOfAllBounces) {
    const float albedo = 0.8F;
    const Scene scene = room_of(Rgb(albedo));
    RunningStats scattered;
    const VirtualLightSets sets = lights_of(scene, 64, 64);
    for (std::size_t set = 0; set < 64; ++set) {
        double sum = 0;
        for (std::uint32_t i = sets.begins[set]; i < sets.begins[set + 1]; ++i) {
            sum += double{luminance(sets.lights[i].contribution)} * M_PI;
        }
        scattered.add(sum / 64);
    }
    EXPECT_TRUE(testing::agrees(scattered, 4 * M_PI * 0.8 / 0.2)) << scattered.mean();
    EXPECT_FALSE(testing::agrees(scattered, 4 * M_PI * 0.84 / 0.16)) << "another albedo is told";
}

TEST(VirtualLights, WhereNothingIsAbsorbed_End) {
    const VirtualLightSets sets = lights_of(room_of(Rgb(1.0F)), 4, 4);
    // A thousand bounces a path in the mean; sixteen paths' mean has a quarter of that as its deviation.
    EXPECT_GT(sets.lights.size(), 16U * 200);
    EXPECT_LT(sets.lights.size(), 16U * 2500);
}

// A curtain shines where its light goes: on both sides, by its two albedos.
TEST(VirtualLights, OfACurtain_ShineOnBothSides) {
    SceneMaker make;
    DiffuseTransmissionMaterial curtain;
    curtain.reflectance = RgbTexture::constant(Rgb(0.2F));
    curtain.transmittance = RgbTexture::constant(Rgb(0.6F));
    make.quad({-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, make.material(curtain));
    make.light(make_point_light(V3f(0, 0, -0.5F), Rgb(1.0F)));
    const VirtualLightSets sets = lights_of(make.build(), 64, 64);
    double near = 0, far = 0;
    for (const VirtualLight& light : sets.lights) {
        (light.at.n.z < 0 ? near : far) += double{luminance(light.contribution)};
    }
    EXPECT_NEAR(far / near, 3, 0.25);
}

}  // namespace
}  // namespace lucerna
