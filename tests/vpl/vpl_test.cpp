// Tests the VPLs of sets of light paths: lights are chosen by power in every set, VPLs along a path have
// equal strength and together the energy of all bounces, and paths end even where nothing absorbs [Keller
// 1997; Pharr 2004].
#include <gtest/gtest.h>

#include "engine/vpl/vpl.h"
#include "tests/support/materials.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace igi_lights_test {

using testing::SceneMaker;

VplSets lights_of(const Scene& scene, std::uint32_t sets, std::uint32_t paths) {
    Monitor silent;
    VplParameters parameters;
    parameters.sets = sets;
    parameters.paths = paths;
    parameters.seed = 5;
    return build_vpls(scene, parameters, Workers{2}, silent);
}

Scene room_of(const Rgb& albedo, float intensity = 1) {
    SceneMaker make;
    make.room({1, 2, 1}, make.diffuse(albedo));
    make.light(make_point_light(V3f(0.5F, 1, 0.5F), Rgb(intensity)));
    return make.build();
}

TEST(VplStarts, InEverySet_AreSharedOutByPower) {
    SceneMaker make;
    make.light(make_point_light(V3f(0.0F), Rgb(5)));
    make.light(make_point_light(V3f(1.0F), Rgb(2)));
    make.light(make_point_light(V3f(2.0F), Rgb(1)));
    const Scene scene = make.build();
    constexpr std::uint32_t kPaths = 32, kSets = 64;
    Emission emission(scene, 5, Purpose::vpl, 0);
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
            // A light's interval has two ends, at each of which the 32 equal steps of a set may cut.
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

TEST(Vpls, OfGreyWalls_AreAllOfOneStrength) {
    for (const float albedo : {0.2F, 0.5F, 0.9F}) {
        const VplSets sets = lights_of(room_of(Rgb(albedo)), 4, 64);
        ASSERT_GT(sets.lights.size(), 200U);
        for (const Vpl& light : sets.lights) {
            EXPECT_NEAR(luminance(light.contribution) / (4 * kPi * albedo * kInvPi), 1, 1e-3F);
        }
    }
}

// For any colour of the walls the arriving luminance is that of the path's start.
TEST(Vpls, OfColourfulWalls_ComeFromPowersOfOneLuminance) {
    const Rgb albedo(0.9F, 0.3F, 0.05F);
    const VplSets sets = lights_of(room_of(albedo), 4, 64);
    float reddest = 0;
    for (const Vpl& light : sets.lights) {
        const Rgb arrived = light.contribution / albedo * kPi;
        EXPECT_NEAR(luminance(arrived) / (4 * kPi), 1, 2e-3F);
        reddest = std::max(reddest, arrived.x / arrived.y);
    }
    EXPECT_GT(reddest, 10);
}

// Over all bounces the walls scatter Φ ρ/(1 - ρ).
TEST(Vpls, Together_ScatterTheSeriesOfAllBounces) {
    const float albedo = 0.8F;
    const Scene scene = room_of(Rgb(albedo));
    RunningStats scattered;
    const VplSets sets = lights_of(scene, 64, 64);
    for (std::size_t set = 0; set < 64; ++set) {
        double sum = 0;
        for (std::uint32_t i = sets.begins[set]; i < sets.begins[set + 1]; ++i) {
            sum += double{luminance(sets.lights[i].contribution)} * M_PI;
        }
        scattered.add(sum / 64);
    }
    EXPECT_TRUE(testing::agrees(scattered, 4 * M_PI * 0.8 / 0.2)) << scattered.mean();
    EXPECT_FALSE(testing::agrees(scattered, 4 * M_PI * 0.84 / 0.16)) << "another albedo is rejected";
}

TEST(Vpls, WhereNothingIsAbsorbed_End) {
    const VplSets sets = lights_of(room_of(Rgb(1.0F)), 4, 4);
    // A path has a thousand bounces on average; the standard deviation of the mean of sixteen paths is a
    // quarter of that.
    EXPECT_GT(sets.lights.size(), 16U * 200);
    EXPECT_LT(sets.lights.size(), 16U * 2500);
}

// A curtain scatters light to both sides, in proportion to its reflectance and transmittance.
TEST(Vpls, OfACurtain_ShineOnBothSides) {
    SceneMaker make;
    DiffuseTransmissionMaterial curtain;
    curtain.reflectance = RgbTexture::constant(Rgb(0.2F));
    curtain.transmittance = RgbTexture::constant(Rgb(0.6F));
    make.quad({-50, -50, 0}, {100, 0, 0}, {0, 100, 0}, make.material(curtain));
    make.light(make_point_light(V3f(0, 0, -0.5F), Rgb(1.0F)));
    const VplSets sets = lights_of(make.build(), 64, 64);
    double near = 0, far = 0;
    for (const Vpl& light : sets.lights) {
        (light.at.n.z < 0 ? near : far) += double{luminance(light.contribution)};
    }
    EXPECT_NEAR(far / near, 3, 0.01);
}

// The power that the VPLs of one hit emit to either side, for an arriving power of 1.
struct Sent {
    Rgb reflected{0.0F}, transmitted{0.0F};
};
Sent sent_by(const Bsdf& bsdf, const V3f& d, VplGloss gloss, const PathClass& path) {
    Hit hit{};
    hit.at.n = hit.ns = bsdf.geometric_normal();
    const LightPathStart start{};
    Sent sent;
    make_vpls({hit, bsdf, d, Rgb(1.0F), path, start}, gloss, [&](const Vpl& light) {
        (light.at.n.dot(-d) > 0 ? sent.reflected : sent.transmitted) += light.contribution * kPi;
    });
    return sent;
}
// Estimates the same from samples of the BSDF without delta lobes, or with them.
Sent sampled(const Bsdf& bsdf, const V3f& d, std::array<double, 2>& error, bool deltas = false) {
    std::array<std::array<RunningStats, 3>, 2> stats;
    Sampler sampler(9, Purpose::test, 0, 0);
    for (int i = 0; i < 40'000; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = bsdf.sample(-d, u, Transport::particles);
        for (std::size_t side = 0; side < 2; ++side) {
            const bool counts = sample && (deltas || !sample->delta) && sample->transmission == (side == 1);
            for (std::size_t c = 0; c < 3; ++c)
                stats[side][c].add(counts ? static_cast<double>(sample->weight[static_cast<int>(c)]) : 0.0);
        }
    }
    Sent sent;
    for (std::size_t c = 0; c < 3; ++c) {
        sent.reflected[static_cast<int>(c)] = static_cast<float>(stats[0][c].mean());
        sent.transmitted[static_cast<int>(c)] = static_cast<float>(stats[1][c].mean());
        for (std::size_t side = 0; side < 2; ++side)
            error[side] = std::max(error[side], stats[side][c].standard_error());
    }
    return sent;
}

// A VPL represents exactly what a surface scatters to its side by lobes other than deltas. An albedo is
// within 0.012 of the mean of samples (engine/scene/bsdf.h); 4 sigmas are added.
TEST(Vpls, OfAnyMaterial_SendWhatItsSamplesWithoutDeltasSend) {
    const V3f d = V3f(0.6F, 0.1F, -0.8F).normalized();
    int rejected = 0;
    for (const testing::Sample& sample : testing::all_materials()) {
        Hit hit{};
        hit.at.n = hit.ns = V3f(0, 0, 1);
        hit.dpdu = V3f(1, 0, 0);
        hit.dpdv = V3f(0, 1, 0);
        hit.uv = V2f(0.3F, 0.4F);
        const Material material = sample.material();
        if (is_interface(material)) continue;
        for (const float side : {1.0F, -1.0F}) {
            const Bsdf bsdf = make_bsdf(material, hit);
            const V3f way(d.x, d.y, side * d.z);
            const Sent sent = sent_by(bsdf, way, VplGloss::all, {});
            std::array<double, 2> error{};
            const Sent expected = sampled(bsdf, way, error);
            const auto off = [](const Rgb& a, const Rgb& b) {
                return std::max(max_component(a - b), max_component(b - a));
            };
            EXPECT_LT(off(sent.reflected, expected.reflected), 0.012 + 4 * error[0]) << sample.name;
            EXPECT_LT(off(sent.transmitted, expected.transmitted), 0.012 + 4 * error[1]) << sample.name;
            // The same comparison rejects values that include deltas.
            const Sent wrong = sampled(bsdf, way, error, true);
            const bool differs = off(sent.reflected, wrong.reflected) > 0.012 + 4 * error[0] ||
                                 off(sent.transmitted, wrong.transmitted) > 0.012 + 4 * error[1];
            if (differs && !bsdf.is_delta()) ++rejected;
        }
    }
    EXPECT_GT(rejected, 4) << "materials with deltas beside other lobes";
}

// With VplGloss::of_indirect VPLs include gloss only where the light had been scattered before; otherwise
// photons or rays carry it.
TEST(Vpls, OfGloss_GoByWhatTheLightMetBefore) {
    UberMaterial plastic = testing::uber(testing::grey(0.4F), testing::grey(0.5F), 0.2F, 0.2F);
    Hit hit{};
    hit.at.n = hit.ns = V3f(0, 0, 1);
    hit.dpdu = V3f(1, 0, 0);
    const Material material{"plastic", plastic};
    const Bsdf bsdf = make_bsdf(material, hit);
    const V3f d = V3f(0.6F, 0.1F, -0.8F).normalized();
    const float all = bsdf.albedo(-d).x, diffuse = bsdf.diffuse_part().albedo(-d).x;
    ASSERT_GT(all, diffuse + 0.01F);
    const PathClass straight{}, by_mirrors{2, 0}, scattered{1, 1};
    constexpr auto none = VplGloss::none, of_indirect = VplGloss::of_indirect;
    for (const PathClass& path : {straight, by_mirrors, scattered}) {
        EXPECT_NEAR(sent_by(bsdf, d, VplGloss::all, path).reflected.x, all, 1e-5F);
        EXPECT_NEAR(sent_by(bsdf, d, none, path).reflected.x, diffuse, 1e-5F);
    }
    EXPECT_NEAR(sent_by(bsdf, d, of_indirect, straight).reflected.x, diffuse, 1e-5F);
    EXPECT_NEAR(sent_by(bsdf, d, of_indirect, by_mirrors).reflected.x, diffuse, 1e-5F);
    EXPECT_NEAR(sent_by(bsdf, d, of_indirect, scattered).reflected.x, all, 1e-5F);
}

}  // namespace igi_lights_test
}  // namespace lucerna
