#include "engine/scene/material.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"
#include "engine/scene/scene.h"
#include "tests/support/materials.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace material_test {

using namespace lucerna::testing;

Hit hit_at(const V2f& uv) {
    Hit hit;
    hit.at.n = V3f(0, 0, 1);
    hit.ns = V3f(0.6F, 0, 0.8F);
    hit.dpdu = V3f(1, 0, 0);
    hit.uv = uv;
    return hit;
}

const V3f kOut(0, 0.6F, 0.8F);

TEST(Material, Diffuse_Textured_TakesTheColourAtTheHit) {
    const auto squares = RgbTexture::checkerboard(Rgb(0.2F), Rgb(0.7F), V2f(1, 1));
    const Material material{"tiles", DiffuseMaterial{squares}};
    EXPECT_EQ(make_bsdf(material, hit_at({0.5F, 0.5F})).albedo(kOut), Rgb(0.2F));
    EXPECT_EQ(make_bsdf(material, hit_at({1.5F, 0.5F})).albedo(kOut), Rgb(0.7F));
    EXPECT_TRUE(make_bsdf(material, hit_at({0, 0})).is_diffuse());
}

TEST(Material, AnyKind_KeepsBothNormalsOfTheHit) {
    const Bsdf bsdf = make_bsdf({"", MirrorMaterial{}}, hit_at({0, 0}));
    EXPECT_EQ(bsdf.shading_normal(), V3f(0.6F, 0, 0.8F));
    EXPECT_EQ(bsdf.geometric_normal(), V3f(0, 0, 1));
    // Reflection is about the shading normal.
    const auto sample = bsdf.sample(V3f(0.6F, 0, 0.8F), {0, {0, 0}}, Transport::radiance);
    ASSERT_TRUE(sample);
    EXPECT_LT((sample->wi - V3f(0.6F, 0, 0.8F)).length(), 1e-6F);
    EXPECT_EQ(sample->weight, Rgb(0.9F));
}

TEST(Material, Conductor_Anisotropic_IsOrientedByTheTangent) {
    ConductorMaterial brushed;
    brushed.roughness = Roughness::of_alpha(0.02F, 0.5F);
    Hit hit = hit_at({0, 0});
    hit.ns = hit.at.n;
    const V3f wide = V3f(0, 0.5F, 0.866025F);
    const V3f narrow = V3f(0.5F, 0, 0.866025F);
    const V3f up(0, 0, 1);
    const Bsdf along_x = make_bsdf({"", brushed}, hit);
    EXPECT_GT(along_x.pdf_w(up, wide), 10 * along_x.pdf_w(up, narrow));
    hit.dpdu = V3f(0, 5, 0);
    const Bsdf along_y = make_bsdf({"", brushed}, hit);
    EXPECT_GT(along_y.pdf_w(up, narrow), 10 * along_y.pdf_w(up, wide));
}

TEST(Material, IsSpecular_SmoothAndRough_TellsDeltaLobes) {
    EXPECT_FALSE(is_specular({"", DiffuseMaterial{}}));
    EXPECT_TRUE(is_specular({"", MirrorMaterial{}}));
    EXPECT_TRUE(is_specular({"", ConductorMaterial{}}));
    EXPECT_TRUE(is_specular({"", DielectricMaterial{}}));
    EXPECT_FALSE(is_specular({"", InterfaceMaterial{}}));
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(0.1F, 0);
    EXPECT_FALSE(is_specular({"", metal}));  // roughness along one axis suffices
    metal.roughness = Roughness::of_alpha(0.5F * kSmoothAlpha, 0);
    EXPECT_TRUE(is_specular({"", metal}));
    DielectricMaterial glass;
    glass.roughness = Roughness::of_alpha(0.1F);
    EXPECT_FALSE(is_specular({"", glass}));
}

TEST(Material, IsSpecular_SumsAndMixes_TellAnyDeltaLobe) {
    EXPECT_FALSE(is_specular({"", uber(grey(0.5F), grey(0.5F), 0.1F, 0.1F)}));
    UberMaterial seen_through = uber(grey(0.5F), grey(0.5F), 0.1F, 0.1F);
    seen_through.opacity = grey(0.5F);
    EXPECT_TRUE(is_specular({"", seen_through}));
    EXPECT_TRUE(is_specular({"", coated(grey(0.5F), 0)}));
    EXPECT_FALSE(is_specular({"", coated(grey(0.5F), 0.1F)}));
    EXPECT_TRUE(is_specular({"", mix(DiffuseMaterial{}, MirrorMaterial{}, 0.1F)}));
    EXPECT_TRUE(is_specular({"", mix(DiffuseMaterial{}, InterfaceMaterial{}, 0.1F)}));
    EXPECT_FALSE(is_specular({"", mix(DiffuseMaterial{}, SubstrateMaterial{}, 0.1F)}));
}

TEST(Material, Texture_BeyondAReflectance_IsHeldWhereItIsLookedUp) {
    const Material material{"", DiffuseMaterial{color(3, -1, NAN)}};
    EXPECT_EQ(make_bsdf(material, flat_hit()).albedo(kUp), Rgb(1, 0, 0));
}

TEST(Material, Opacity_LetsTheRestStraightThrough) {
    UberMaterial leaf = uber(grey(1), grey(0), 0.1F, 0.1F);
    leaf.opacity = grey(0.25F);
    const Material material{"", leaf};
    const Bsdf bsdf = make_bsdf(material, flat_hit());
    const V3f wo = direction(30);
    const auto through = bsdf.sample(wo, {0.9F, {0.5F, 0.5F}}, Transport::radiance);
    ASSERT_TRUE(through && through->delta && through->transmission);
    EXPECT_EQ(through->wi, -wo);
    EXPECT_NEAR(through->weight.x, 1, 1e-5F) << "0.75 over its chance";
    EXPECT_EQ(bsdf.diffuse_part().albedo(wo), Rgb(0.25F));
}

// Lobes that opacity removes completely must not make the surface one that scatters.
TEST(Material, OpacityZero_IsADelta_AndNothingElse) {
    for (const float kd : {0.5F, 0.9F}) {  // 0.9 beside gloss gives a base under a cover
        UberMaterial uber = testing::uber(testing::grey(kd), testing::grey(0.5F), 0.1F, 0.1F);
        uber.reflect = testing::grey(0.3F);
        uber.opacity = testing::grey(0);
        const Material material{"", uber};
        Hit hit{};
        hit.at.n = hit.ns = V3f(0, 0, 1);
        hit.dpdu = V3f(1, 0, 0);
        const Bsdf bsdf = make_bsdf(material, hit);
        EXPECT_TRUE(bsdf.is_delta());
        EXPECT_FALSE(bsdf.has_diffuse());
        const auto sample = bsdf.sample(V3f(0.6F, 0, 0.8F), {0.3F, V2f(0.2F, 0.7F)}, Transport::radiance);
        ASSERT_TRUE(sample);
        EXPECT_EQ(sample->weight, Rgb(1.0F));
        EXPECT_EQ(sample->wi, V3f(-0.6F, 0, -0.8F));
    }
}

TEST(Material, HasPeak_DeltasAndGloss_NotWhatIsDiffuseAlone) {
    const auto may_peak = [](MaterialModel model) { return has_peak({"", std::move(model)}); };
    EXPECT_FALSE(may_peak(DiffuseMaterial{}));
    EXPECT_FALSE(may_peak(DiffuseTransmissionMaterial{}));
    EXPECT_FALSE(may_peak(testing::uber(testing::grey(0.5F), testing::grey(0), 0.1F, 0.1F)));
    EXPECT_FALSE(may_peak(testing::mix(DiffuseMaterial{}, DiffuseMaterial{}, 0.5F)));
    EXPECT_TRUE(may_peak(MirrorMaterial{}));
    EXPECT_TRUE(may_peak(testing::rough_copper(0.5F)));
    EXPECT_TRUE(may_peak(TranslucentMaterial{}));
    EXPECT_TRUE(may_peak(testing::uber(testing::grey(0.5F), testing::grey(0.1F), 0.1F, 0.1F)));
    EXPECT_TRUE(may_peak(testing::mix(DiffuseMaterial{}, InterfaceMaterial{}, 0.5F)));
    EXPECT_TRUE(may_peak(testing::mix(DiffuseMaterial{}, MirrorMaterial{}, 0.5F)));
}

// If a material reports the answer for all its points, then each of its Bsdfs agrees, black ones included.
TEST(Material, HasDiffuse_WhereItIsKnown_IsWhatEveryBsdfHas) {
    const auto black = RgbTexture::constant(Rgb(0.0F));
    SubstrateMaterial no_base;
    no_base.diffuse = black;
    const MaterialModel known[] = {DiffuseMaterial{},
                                   DiffuseMaterial{black},
                                   DiffuseMaterial{black, FloatTexture::constant(20)},
                                   DiffuseTransmissionMaterial{},
                                   DiffuseTransmissionMaterial{black, black},
                                   coated(grey(0.5F), 0.1F),
                                   coated(grey(0), 0),
                                   SubstrateMaterial{},
                                   no_base,
                                   MirrorMaterial{},
                                   ConductorMaterial{},
                                   rough_copper(0.3F),
                                   DielectricMaterial{},
                                   ThinDielectricMaterial{},
                                   CoatedConductorMaterial{coated(grey(0.5F), 0.1F).coat, {}},
                                   ShinyMetalMaterial{}};
    for (const MaterialModel& model : known) {
        const Material material{"", model};
        const auto always = has_diffuse(material);
        ASSERT_TRUE(always) << model.index();
        EXPECT_EQ(*always, make_bsdf(material, flat_hit()).has_diffuse()) << model.index();
    }
    EXPECT_FALSE(has_diffuse({"", uber(grey(0.5F), grey(0.5F), 0.1F, 0.1F)})) << "its opacity may vary";
    EXPECT_FALSE(has_diffuse({"", mix(DiffuseMaterial{}, MirrorMaterial{}, 0.5F)}));
    EXPECT_FALSE(has_diffuse({"", InterfaceMaterial{}}));
}

TEST(Material, Mix_OfAnInterface_LetsItsShareThrough) {
    const Material material{"", mix(DiffuseMaterial{grey(0.5F)}, InterfaceMaterial{}, 0.75F)};
    const Bsdf bsdf = make_bsdf(material, flat_hit());
    EXPECT_EQ(bsdf.albedo(kUp), Rgb(0.25F * 0.5F + 0.75F));
    EXPECT_TRUE(bsdf.rest().is_delta());
}

TEST(Material, MostLobes_EveryMaterial_IsNotExceeded) {
    for (const Sample& sample : all_materials()) {
        const Material material = sample.material();
        EXPECT_LE(most_lobes(material), Bsdf::kMaxLobes) << sample.name;
        LobeList list;
        add_lobes(material.model, V2f(0, 0), list);
        EXPECT_LE(list.size(), most_lobes(material)) << sample.name;
        EXPECT_GE(list.size(), 1U) << sample.name;
    }
}

// Returns one of the materials that are sums of lobes, with random parameters.
Material any_sum(Sampler& sampler, const std::shared_ptr<const CoatTable>& table) {
    const auto any = [&] { return color(sampler.next(), sampler.next(), sampler.next()); };
    const Roughness rough = Roughness::of_alpha(sampler.next());
    UberMaterial sum{any(), any(), any(), any(), any(), FloatTexture::constant(1.5F), rough, table};
    if (sampler.next() < 0.5F) sum.transmit.reset();
    if (sampler.next() < 0.5F) sum.reflect.reset();
    switch (static_cast<int>(6 * sampler.next())) {
        case 0:
            return {"translucent", TranslucentMaterial{any(), any(), any(), any(), rough}};
        case 1:
            return {"substrate",
                    SubstrateMaterial{any(), any(), Roughness::of_alpha(sampler.next(), sampler.next())}};
        case 2:
            return {"shinymetal", ShinyMetalMaterial{any(), any(), rough}};
        case 3:
            return {"mix", mix(sum, CoatedDiffuseMaterial{any(), {1.5F, rough, table}}, sampler.next())};
        default:
            return {"uber", sum};
    }
}

TEST(Material, Energy_RandomSums_NeverExceedsOne) {
    Sampler sampler(61, Purpose::test, 0, 0);
    const auto table = std::make_shared<CoatTable>(1.5F);  // for any alpha: its error is 0.01
    for (int i = 0; i < 120; ++i) {
        const Material material = any_sum(sampler, table);
        const Bsdf bsdf = make_bsdf(material, flat_hit());
        for (const float z : {0.5F * sampler.next(), -sampler.next(), 1e-3F}) {
            const V3f wo(std::sqrt(1 - z * z), 0, z);
            RunningStats mean[3];
            for (int k = 0; k < 3000; ++k) {
                const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, Transport::particles);
                for (int c = 0; c < 3; ++c)
                    mean[c].add(sample ? static_cast<double>(sample->weight[c]) : 0.0);
            }
            for (const RunningStats& m : mean) {
                EXPECT_LE(m.mean(), 1.012 + 5 * m.standard_error())
                    << material.name << " " << i << " at " << z;
            }
        }
    }
}

TEST(Material, Interface_IsNothingElse) {
    EXPECT_TRUE(is_interface({"", InterfaceMaterial{}}));
    EXPECT_FALSE(is_interface({"", DielectricMaterial{}}));
    EXPECT_DEATH(make_bsdf({"", InterfaceMaterial{}}, hit_at({0, 0})), "interface");
}

}  // namespace material_test
}  // namespace lucerna
