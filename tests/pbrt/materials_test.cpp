// Materials of both dialects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/scene/scene.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace materials_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

template <typename Model>
Model only(const std::string& world) {
    return std::get<Model>(read_world(world + " Shape \"sphere\"").draft.materials.at(0).model);
}

V2f alpha_of_roughness(const Roughness& roughness) {
    return roughness.alpha(V2f(0, 0));
}
template <typename Model>
V2f alpha(const Model& model) {
    return alpha_of_roughness(model.roughness);
}

TEST(Materials, Default_IsHalfGrey) {
    EXPECT_EQ(only<DiffuseMaterial>("").reflectance.at(V2f(0, 0)), Rgb(0.5F));
    EXPECT_EQ(only<DiffuseMaterial>("Material \"matte\"").reflectance.at(V2f(0, 0)), Rgb(0.5F));
    EXPECT_EQ(only<DiffuseMaterial>("Material \"diffuse\"").reflectance.at(V2f(0, 0)), Rgb(0.5F));
    EXPECT_EQ(only<MirrorMaterial>("Material \"mirror\"").reflectance.at(V2f(0, 0)), Rgb(0.9F));
}

TEST(Materials, Diffuse_TakesItsColourUnderEitherName) {
    EXPECT_EQ(only<DiffuseMaterial>("Material \"matte\" \"color Kd\" [.1 .2 .3]").reflectance.at(V2f(0, 0)),
              Rgb(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(only<DiffuseMaterial>("Material \"diffuse\" \"rgb reflectance\" [.1 .2 .3]")
                  .reflectance.at(V2f(0, 0)),
              Rgb(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(only<DiffuseMaterial>("Material \"matte\" \"float sigma\" 20").sigma.constant_value(), 20.0F);
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"float sigma\" 100"), HasSubstr("100 is not accepted"));
    EXPECT_EQ(refusal_of_world("Material \"matte\" \"rgb Kd\" [1 1 1]"), "");
}

TEST(Materials, Reflectance_AboveOne_IsHeldAtOneWithAWarning) {
    const Read read = read_world("Material \"matte\" \"rgb Kd\" [.5 1.5 .5] Shape \"sphere\"");
    EXPECT_THAT(read.warnings.at(0),
                HasSubstr("scene.pbrt:2:18: \"Kd\" is 0.5 1.5 0.5; a surface reflects at most 1"));
    EXPECT_EQ(std::get<DiffuseMaterial>(read.draft.materials.at(0).model).reflectance.at(V2f(0, 0)),
              Rgb(0.5F, 1, 0.5F));
}

TEST(Materials, Glass_SpeaksItsOwnDialect) {
    const auto v3 = only<DielectricMaterial>(
        "Material \"glass\" \"float index\" 1.33 \"rgb Kr\" [1 0 0] \"rgb Kt\" [0 1 0]");
    EXPECT_EQ(v3.eta.constant_value(), 1.33F);
    EXPECT_EQ(v3.reflect.at(V2f(0, 0)), Rgb(1, 0, 0));
    EXPECT_EQ(v3.transmit.at(V2f(0, 0)), Rgb(0, 1, 0));
    EXPECT_EQ(alpha(v3), V2f(0, 0));
    const auto v4 = only<DielectricMaterial>("Material \"dielectric\" \"float eta\" 1.4");
    EXPECT_EQ(v4.eta.constant_value(), 1.4F);
    EXPECT_EQ(alpha(v4), V2f(0, 0));
    EXPECT_EQ(only<DielectricMaterial>("Material \"glass\"").eta.constant_value(), 1.5F);
    EXPECT_EQ(only<DielectricMaterial>("Material \"dielectric\" \"spectrum eta\" \"glass-SF11\"")
                  .eta.constant_value(),
              1.78472F);
    EXPECT_THAT(refusal_of_world("Material \"dielectric\" \"float eta\" 0"), HasSubstr("0 is not accepted"));
}

TEST(Materials, Roughness_IsMappedAsEachVersionDoes) {
    // Version 4 takes the root. Version 3 at 0.1, with x = ln 0.1: 1.62142 + 0.819955x + 0.1734x² +
    // 0.0171201x³ + 0.000640711x⁴.
    EXPECT_FLOAT_EQ(alpha(only<DielectricMaterial>("Material \"dielectric\" \"float roughness\" 0.25")).x,
                    0.5F);
    EXPECT_NEAR(alpha(only<DielectricMaterial>("Material \"glass\" \"float roughness\" 0.1")).x, 0.46176,
                1e-5);
    const auto plain = only<DielectricMaterial>(
        "Material \"glass\" \"float uroughness\" 0.1 \"float vroughness\" 0.2 \"bool remaproughness\" false");
    EXPECT_EQ(alpha(plain), V2f(0.1F, 0.2F));
    EXPECT_EQ(alpha(only<ConductorMaterial>("Material \"conductor\"")).x, 0) << "version 4's metal is smooth";
    EXPECT_GT(alpha(only<ConductorMaterial>("Material \"metal\"")).x, 0.1F)
        << "version 3's has roughness 0.01";
    EXPECT_GT(alpha(only<ConductorMaterial>("Material \"metal\" \"float roughness\" 0")).x, 0)
        << "and is never smooth";
    const auto varies = only<ConductorMaterial>(
        "Texture \"t\" \"float\" \"constant\" \"float value\" 0.25 Material \"conductor\" \"texture "
        "roughness\" \"t\"");
    EXPECT_FLOAT_EQ(alpha(varies).y, 0.5F);
    EXPECT_THAT(refusal_of_world("Material \"metal\" \"float roughness\" -0.5"),
                HasSubstr("-0.5 is not accepted"));
    EXPECT_THAT(read_world("Material \"metal\" \"float roughness\" 1.5").warnings.at(0),
                HasSubstr("1 is used"));
    EXPECT_THAT(refusal_of_world("Material \"metal\" \"texture roughness\" \"t\""),
                HasSubstr("no texture \"t\""));
}

TEST(Materials, Roughness_OfVersionTwo_IsABlinnExponent) {
    // With the exponent 1/r, alpha² = 2/(1/r + 2).
    EXPECT_NEAR(alpha_of(RoughnessMap::v2, 0.1F), std::sqrt(2.0 / 12), 1e-6);
    EXPECT_NEAR(alpha_of(RoughnessMap::v2, 0), std::sqrt(2.0 / 10002), 1e-6) << "pbrt's largest exponent";
}

TEST(Materials, Metal_KnowsItsNamedSpectra) {
    const auto gold = only<ConductorMaterial>(
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"");
    EXPECT_NEAR(gold.eta.at(V2f(0, 0)).x, 0.119, 0.002);
    EXPECT_NEAR(gold.k.at(V2f(0, 0)).z, 1.764, 0.002);
    const auto rgb = only<ConductorMaterial>("Material \"metal\" \"rgb eta\" [1 2 3] \"rgb k\" [4 5 6]");
    EXPECT_EQ(rgb.eta.at(V2f(0, 0)), Rgb(1, 2, 3));
    EXPECT_EQ(rgb.k.at(V2f(0, 0)), Rgb(4, 5, 6));
    EXPECT_NEAR(only<ConductorMaterial>("Material \"metal\"").eta.at(V2f(0, 0)).x, 0.166, 1e-3) << "copper";
    const auto copper = only<ConductorMaterial>(
        "Material \"conductor\" \"spectrum eta\" \"metal-Cu-eta\" \"spectrum k\" \"metal-Cu-k\"");
    const auto unsaid = only<ConductorMaterial>("Material \"conductor\"");
    EXPECT_LT((copper.eta.at(V2f(0, 0)) - unsaid.eta.at(V2f(0, 0))).length(), 1e-4F);
    EXPECT_LT((copper.k.at(V2f(0, 0)) - unsaid.k.at(V2f(0, 0))).length(), 1e-4F);
    const auto r = only<ConductorMaterial>("Material \"conductor\" \"rgb reflectance\" [.2 .5 .8]");
    EXPECT_EQ(r.reflectance->at(V2f(0, 0)), Rgb(0.2F, 0.5F, 0.8F));
    EXPECT_THAT(refusal_of_world("Material \"conductor\" \"rgb reflectance\" [1 1 1] \"rgb k\" [1 1 1]"),
                HasSubstr("exclude each other"));
}

TEST(Materials, Interface_HasThreeNames) {
    for (const std::string name : {"", "none", "interface"}) {
        only<InterfaceMaterial>("Material \"" + name + "\"");
    }
}

TEST(Materials, OtherNames_AreToldFromUnknownOnes) {
    EXPECT_THAT(refusal_of_world("Material \"disney\""), HasSubstr("material \"disney\" is not supported"));
    EXPECT_THAT(refusal_of_world("Material \"difuse\""),
                HasSubstr("unknown Material \"difuse\"; did you mean \"diffuse\"?"));
}

TEST(Materials, EveryName_OfPbrt_IsReadWithItsDefaults) {
    for (const std::string name : {"diffuse", "coateddiffuse", "conductor", "coatedconductor", "dielectric",
                                   "thindielectric", "diffusetransmission", "matte", "plastic", "uber",
                                   "glass", "metal", "mirror", "shinymetal", "substrate", "translucent"}) {
        const Read read = read_world("Material \"" + name + "\" Shape \"sphere\"");
        EXPECT_TRUE(read.warnings.empty()) << name << ": " << read.warnings.front();
        EXPECT_GT(most_lobes(read.draft.materials.at(0)), 0U);
    }
}

TEST(Materials, Uber_KeepsWhatIsRareApart) {
    const auto plain = only<UberMaterial>("Material \"uber\" \"rgb opacity\" [1 1 1] \"rgb Kr\" [0 0 0]");
    EXPECT_FALSE(plain.opacity || plain.reflect || plain.transmit);
    EXPECT_TRUE(plain.table);
    const auto full = only<UberMaterial>(
        "Material \"uber\" \"rgb Kt\" [.1 .2 .3] \"rgb Kr\" [.3 .2 .1] \"rgb opacity\" [.5 .5 .5] \"float "
        "index\" 1.3 "
        "\"float uroughness\" 0.01 \"float vroughness\" 0.3 \"bool remaproughness\" false");
    EXPECT_EQ(full.transmit->at(V2f(0, 0)), Rgb(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(full.reflect->at(V2f(0, 0)), Rgb(0.3F, 0.2F, 0.1F));
    EXPECT_EQ(full.opacity->at(V2f(0, 0)), Rgb(0.5F));
    EXPECT_EQ(full.eta.constant_value(), 1.3F);
    EXPECT_EQ(alpha(full), V2f(0.01F, 0.3F));
}

TEST(Materials, Covers_OfEqualVarnish_AreShared) {
    const Read read = read_world(
        "Material \"plastic\" \"rgb Kd\" [1 0 0] Shape \"sphere\" Material \"plastic\" Shape \"sphere\" "
        "Material \"plastic\" \"float roughness\" 0.3 Shape \"sphere\"");
    const auto table = [&](std::size_t i) {
        return std::get<UberMaterial>(read.draft.materials.at(i).model).table;
    };
    EXPECT_EQ(table(0), table(1));
    EXPECT_NE(table(0), table(2));
}

TEST(Materials, CoatedConductor_ReadsBothLayers) {
    const auto metal = only<CoatedConductorMaterial>(
        "Material \"coatedconductor\" \"float interface.eta\" 1.7 \"float interface.roughness\" 0.04 "
        "\"float conductor.roughness\" 0.25 \"rgb conductor.eta\" [1 2 3] \"rgb conductor.k\" [3 2 1] "
        "\"float thickness\" 0.01 \"integer maxdepth\" 10");
    EXPECT_EQ(metal.coat.eta, 1.7F);
    EXPECT_FLOAT_EQ(alpha_of_roughness(metal.coat.roughness).x, 0.2F);
    EXPECT_FLOAT_EQ(alpha(metal.metal).x, 0.5F);
    EXPECT_EQ(metal.metal.k.at(V2f(0, 0)), Rgb(3, 2, 1));
}

TEST(Materials, Mix_CountsShares_AsEachVersionDoes) {
    const std::string parts =
        "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 1 1] "
        "MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0] ";
    const auto albedo = [&](const std::string& mix) {
        const Read read = read_world(parts + "Material \"mix\" " + mix + " Shape \"sphere\"");
        Hit hit;
        hit.at.n = hit.ns = V3f(0, 0, 1);
        hit.dpdu = V3f(1, 0, 0);
        return make_bsdf(read.draft.materials.at(0), hit).albedo(V3f(0, 0, 1)).x;
    };
    EXPECT_FLOAT_EQ(albedo("\"string materials\" [\"a\" \"b\"] \"float amount\" 0.25"), 0.75F)
        << "of the second";
    EXPECT_FLOAT_EQ(albedo("\"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" "
                           "[.25 .25 .25]"),
                    0.25F)
        << "of the first";
    EXPECT_FLOAT_EQ(albedo("\"string materials\" [\"a\" \"b\"]"), 0.5F);
    EXPECT_THAT(refusal_of_world(parts + "Material \"mix\" \"string materials\" [\"a\" \"c\"]"),
                HasSubstr("there is no material \"c\""));
    EXPECT_THAT(refusal_of_world(parts + "Material \"mix\" \"string materials\" [\"a\"]"),
                HasSubstr("expected 2"));
    EXPECT_THAT(refusal_of_world(parts + "Material \"mix\""), HasSubstr("namedmaterial1"));
}

TEST(Materials, Mix_OfTooManyLobes_IsRefused) {
    std::string text = "MakeNamedMaterial \"m\" \"string type\" \"uber\" ";
    for (const char* name : {"n", "o"}) {
        const std::string part = name == std::string("n") ? "m" : "n";
        text += "MakeNamedMaterial \"" + std::string(name) +
                "\" \"string type\" \"mix\" \"string materials\" [\"" + part + "\" \"" + part + "\"] ";
    }
    EXPECT_THAT(refusal_of_world(text), HasSubstr("16 lobes in total; the limit is 8"));
}

TEST(Materials, Named_AreSharedByTheirUsers) {
    const Read read = read_world(
        "MakeNamedMaterial \"red\" \"string type\" \"diffuse\" \"rgb reflectance\" [1 0 0] "
        "MakeNamedMaterial \"unused\" \"string type\" \"mirror\" "
        "Shape \"disk\" NamedMaterial \"red\" Shape \"sphere\" Shape \"sphere\"");
    ASSERT_EQ(read.draft.materials.size(), 2U) << "what no surface uses is left out";
    EXPECT_EQ(read.draft.quadrics[1].traits.material, 1U);
    EXPECT_EQ(read.draft.quadrics[2].traits.material, 1U);
    EXPECT_EQ(read.draft.materials[1].name, "red");
    EXPECT_THAT(refusal_of_world("MakeNamedMaterial \"red\" \"string type\" \"matte\" NamedMaterial \"rad\""),
                HasSubstr("no material \"rad\"; did you mean \"red\"?"));
    EXPECT_THAT(refusal_of_world("MakeNamedMaterial \"red\""), HasSubstr("lacks \"string type\""));
    EXPECT_THAT(
        read_world(
            "MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"a\" \"string type\" "
            "\"matte\"")
            .warnings.at(0),
        HasSubstr("is defined again"));
}

}  // namespace materials_test
}  // namespace lucerna
