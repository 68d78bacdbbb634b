#include "engine/world/material.h"

#include <gtest/gtest.h>

#include "engine/world/scene.h"

namespace lucerna {
namespace {

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
    EXPECT_FALSE(is_specular({"", metal}));  // rough along one axis is rough
    metal.roughness = Roughness::of_alpha(0.5F * kSmoothAlpha, 0);
    EXPECT_TRUE(is_specular({"", metal}));
    DielectricMaterial glass;
    glass.roughness = Roughness::of_alpha(0.1F);
    EXPECT_FALSE(is_specular({"", glass}));
}

TEST(Material, Interface_IsNothingElse) {
    EXPECT_TRUE(is_interface({"", InterfaceMaterial{}}));
    EXPECT_FALSE(is_interface({"", DielectricMaterial{}}));
#ifndef NDEBUG
    EXPECT_DEATH(make_bsdf({"", InterfaceMaterial{}}, hit_at({0, 0})), "interface");
#endif
}

}  // namespace
}  // namespace lucerna
