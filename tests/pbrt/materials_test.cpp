// Materials and textures of both dialects.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/image.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using namespace lucerna::testing;
using ::testing::HasSubstr;

template <typename Model>
Model only(const std::string& world) {
    return std::get<Model>(read_world(world + " Shape \"sphere\"").draft.materials.at(0).model);
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
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"float sigma\" 20"),
                HasSubstr("\"sigma\" (Oren-Nayar) is not"));
    EXPECT_EQ(refusal_of_world("Material \"matte\" \"float sigma\" 0"), "");
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"rgb Kd\" [.5 1.5 .5]"),
                HasSubstr("scene.pbrt:2:18: \"Kd\" is 0.5 1.5 0.5; a surface reflects at most 1"));
    EXPECT_EQ(refusal_of_world("Material \"matte\" \"rgb Kd\" [1 1 1]"), "");
}

TEST(Materials, Glass_SpeaksItsOwnDialect) {
    const auto v3 = only<DielectricMaterial>(
        "Material \"glass\" \"float index\" 1.33 \"rgb Kr\" [1 0 0] \"rgb Kt\" [0 1 0]");
    EXPECT_FLOAT_EQ(v3.eta, 1.33F);
    EXPECT_EQ(v3.reflect, Rgb(1, 0, 0));
    EXPECT_EQ(v3.transmit, Rgb(0, 1, 0));
    EXPECT_EQ(v3.alpha_x, 0);
    const auto v4 = only<DielectricMaterial>("Material \"dielectric\" \"float eta\" 1.4");
    EXPECT_FLOAT_EQ(v4.eta, 1.4F);
    EXPECT_EQ(v4.alpha_x, 0);
    EXPECT_FLOAT_EQ(only<DielectricMaterial>("Material \"glass\"").eta, 1.5F);
    EXPECT_FLOAT_EQ(only<DielectricMaterial>("Material \"dielectric\" \"spectrum eta\" \"glass-SF11\"").eta,
                    1.78472F);
    EXPECT_THAT(refusal_of_world("Material \"dielectric\" \"float eta\" 0"), HasSubstr("0 is not accepted"));
}

TEST(Materials, Roughness_IsMappedAsEachVersionDoes) {
    // Version 4: the root. Version 3 at 0.1, x = ln 0.1: 1.62142 + 0.819955x + 0.1734x² + 0.0171201x³ +
    // 0.000640711x⁴.
    EXPECT_FLOAT_EQ(only<DielectricMaterial>("Material \"dielectric\" \"float roughness\" 0.25").alpha_x,
                    0.5F);
    EXPECT_NEAR(only<DielectricMaterial>("Material \"glass\" \"float roughness\" 0.1").alpha_x, 0.46176,
                1e-5);
    const auto plain = only<DielectricMaterial>(
        "Material \"glass\" \"float uroughness\" 0.1 \"float vroughness\" 0.2 \"bool remaproughness\" false");
    EXPECT_FLOAT_EQ(plain.alpha_x, 0.1F);
    EXPECT_FLOAT_EQ(plain.alpha_y, 0.2F);
    EXPECT_EQ(only<ConductorMaterial>("Material \"conductor\"").alpha_x, 0) << "version 4's metal is smooth";
    EXPECT_GT(only<ConductorMaterial>("Material \"metal\"").alpha_x, 0.1F)
        << "version 3's has roughness 0.01";
    EXPECT_GT(only<ConductorMaterial>("Material \"metal\" \"float roughness\" 0").alpha_x, 0)
        << "and is never smooth";
    EXPECT_THAT(refusal_of_world("Material \"metal\" \"float roughness\" 1.5"),
                HasSubstr("1.5 is not accepted"));
    EXPECT_THAT(refusal_of_world("Material \"metal\" \"texture roughness\" \"t\""),
                HasSubstr("not supported here yet"));
}

TEST(Materials, Metal_KnowsItsNamedSpectra) {
    const auto gold = only<ConductorMaterial>(
        "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"");
    EXPECT_FLOAT_EQ(gold.eta.x, 0.1431190F);
    EXPECT_FLOAT_EQ(gold.k.z, 1.6032152F);
    const auto rgb = only<ConductorMaterial>("Material \"metal\" \"rgb eta\" [1 2 3] \"rgb k\" [4 5 6]");
    EXPECT_EQ(rgb.eta, Rgb(1, 2, 3));
    EXPECT_EQ(rgb.k, Rgb(4, 5, 6));
    EXPECT_NEAR(only<ConductorMaterial>("Material \"metal\"").eta.x, 0.2004, 1e-3) << "copper";
    // k = 2 sqrt(r) / sqrt(1 - r) with eta 1 reflects r: k²/(4 + k²).
    const auto r = only<ConductorMaterial>("Material \"conductor\" \"rgb reflectance\" [.2 .5 .8]");
    EXPECT_NEAR(r.k.y * r.k.y / (4 + r.k.y * r.k.y), 0.5, 1e-6);
    EXPECT_THAT(refusal_of_world("Material \"conductor\" \"spectrum eta\" \"metal-CuZn-eta\""),
                HasSubstr("spectrum \"metal-CuZn-eta\" is not supported yet"));
    EXPECT_THAT(refusal_of_world("Material \"conductor\" \"rgb reflectance\" [1 1 1] \"rgb k\" [1 1 1]"),
                HasSubstr("exclude each other"));
}

TEST(Materials, Interface_HasThreeNames) {
    for (const std::string name : {"", "none", "interface"}) {
        only<InterfaceMaterial>("Material \"" + name + "\"");
    }
}

TEST(Materials, OtherNames_AreToldFromUnknownOnes) {
    EXPECT_THAT(refusal_of_world("Material \"plastic\""),
                HasSubstr("Material \"plastic\" is not supported yet"));
    EXPECT_THAT(refusal_of_world("Material \"difuse\""),
                HasSubstr("unknown Material \"difuse\"; did you mean \"diffuse\"?"));
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"texture bumpmap\" \"b\""),
                HasSubstr("\"bumpmap\" is not supported"));
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
                HasSubstr("no material \"rad\" was made before; did you mean \"red\"?"));
    EXPECT_THAT(refusal_of_world("MakeNamedMaterial \"red\""), HasSubstr("lacks \"string type\""));
    EXPECT_THAT(
        read_world(
            "MakeNamedMaterial \"a\" \"string type\" \"matte\" MakeNamedMaterial \"a\" \"string type\" "
            "\"matte\"")
            .warnings.at(0),
        HasSubstr("was made before"));
}

TEST(Textures, Checkerboard_HasItsFirstColourAtTheOrigin) {
    const auto material = only<DiffuseMaterial>(
        "Texture \"t\" \"spectrum\" \"checkerboard\" \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 0 1] \"float "
        "uscale\" 4 "
        "\"float vscale\" 2 Material \"diffuse\" \"texture reflectance\" \"t\"");
    EXPECT_EQ(material.reflectance.at(V2f(0.1F, 0.1F)), Rgb(1, 0, 0));
    EXPECT_EQ(material.reflectance.at(V2f(0.3F, 0.1F)), Rgb(0, 0, 1));
    EXPECT_EQ(material.reflectance.at(V2f(0.1F, 0.6F)), Rgb(0, 0, 1));
    EXPECT_EQ(material.reflectance.at(V2f(0.3F, 0.6F)), Rgb(1, 0, 0));
}

TEST(Textures, ConstantsAndScales_Multiply) {
    const auto material = only<DiffuseMaterial>(
        "Texture \"a\" \"color\" \"constant\" \"color value\" [.5 .6 .8]"
        "Texture \"b\" \"color\" \"scale\" \"texture tex1\" \"a\" \"rgb tex2\" [.5 .5 1]"
        "Material \"matte\" \"texture Kd\" \"b\"");
    EXPECT_EQ(material.reflectance.at(V2f(0, 0)), Rgb(0.25F, 0.3F, 0.8F));
}

TEST(Textures, Imagemap_IsReadFromTheScenesFolder) {
    const TemporaryFolder folder;
    Image image = Image::rgb(2, 2);
    for (int y = 0; y < 2; ++y) {
        for (int x = 0; x < 2; ++x) image.set_rgb(x, y, y == 1 ? Rgb(0.25F) : Rgb(0.75F));
    }
    write_exr(folder / "t.exr", image);
    RecordingMonitor monitor;
    const std::string world =
        "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"t.exr\" \"float scale\" 0.5 "
        "Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"";
    const Draft draft = read_draft(std::string(kHead) + world, folder / "scene.pbrt", {}, monitor);
    const auto model = std::get<DiffuseMaterial>(draft.materials.at(0).model);
    EXPECT_NEAR(model.reflectance.at(V2f(0.5F, 0.25F)).x, 0.125F, 1e-6F) << "v = 0 is the bottom row";
    EXPECT_NEAR(model.reflectance.at(V2f(0.5F, 0.75F)).x, 0.375F, 1e-6F);
    EXPECT_THAT(refusal_of_world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"no.png\""),
                HasSubstr("scene.pbrt:2:35: no.png: "));
}

TEST(Textures, WhatTheyCannotDo_IsRefused) {
    const auto refused = [](const std::string& text) {
        return refusal_of_world("Texture \"t\" \"spectrum\" " + text);
    };
    EXPECT_THAT(refused("\"marble\""), HasSubstr("Texture \"marble\" is not supported yet"));
    EXPECT_THAT(refused("\"imagemap\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refused("\"imagemap\" \"string filename\" \"a\" \"string wrap\" \"clamp\""),
                HasSubstr("wrap \"clamp\""));
    EXPECT_THAT(refused("\"checkerboard\" \"integer dimension\" 3"), HasSubstr("not supported yet"));
    EXPECT_THAT(refused("\"checkerboard\" \"texture tex1\" \"no\""),
                HasSubstr("no texture \"no\" was made before"));
    EXPECT_THAT(refused("\"checkerboard\" \"string mapping\" \"planar\""), HasSubstr("mapping \"planar\""));
    EXPECT_THAT(refused("\"constant\" \"rgb value\" [2 2 2] Material \"matte\" \"texture Kd\" \"t\""),
                HasSubstr("texture \"t\" reaches 2; a surface reflects at most 1"));
    EXPECT_THAT(refusal_of_world("Texture \"t\" \"float\" \"constant\""), HasSubstr("textures of floats"));
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"texture Kd\" \"t\""), HasSubstr("no texture \"t\""));
}

}  // namespace
}  // namespace lucerna
