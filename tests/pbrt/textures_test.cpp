// Textures as the scene text gives them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/image/image.h"
#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace textures_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

template <typename Model>
Model only(const std::string& world) {
    return std::get<Model>(read_world(world + " Shape \"sphere\"").draft.materials.at(0).model);
}

RgbTexture color(const std::string& kind_and_parameters, const std::string& before = "") {
    return only<DiffuseMaterial>(before + " Texture \"t\" \"spectrum\" " + kind_and_parameters +
                                 " Material \"diffuse\" \"texture reflectance\" \"t\"")
        .reflectance;
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

// Returns a float texture as the amount of a mix of black and white.
RgbTexture number(const std::string& kind_and_parameters, const std::string& before = "") {
    return color("\"mix\" \"texture amount\" \"f\"",
                 before + " Texture \"f\" \"float\" " + kind_and_parameters);
}

TEST(Textures, Mix_GoesFromTheFirstToTheSecond) {
    EXPECT_EQ(color("\"mix\" \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 0 1] \"float amount\" 0.25").at(V2f(0, 0)),
              Rgb(0.75F, 0, 0.25F));
    EXPECT_EQ(color("\"mix\"").at(V2f(0, 0)), Rgb(0.5F)) << "pbrt's defaults: 0, 1, half";
    EXPECT_EQ(number("\"constant\" \"float value\" .25").at(V2f(0, 0)), Rgb(0.25F));
    EXPECT_EQ(number("\"scale\" \"float tex\" .5 \"float scale\" .5").at(V2f(0, 0)), Rgb(0.25F));
    EXPECT_EQ(number("\"scale\" \"float tex1\" .5 \"float tex2\" .5").at(V2f(0, 0)), Rgb(0.25F));
}

TEST(Textures, DirectionMix_LooksAtTheNormal) {
    const auto mix =
        color("\"directionmix\" \"rgb tex1\" [1 0 0] \"rgb tex2\" [0 0 1] \"vector3 dir\" [0 0 2]");
    EXPECT_EQ(mix.at({V2f(0, 0), V3d(0), V3f(0, 0, -1)}), Rgb(1, 0, 0));
    EXPECT_EQ(mix.at({V2f(0, 0), V3d(0), V3f(1, 0, 0)}), Rgb(0, 0, 1));
    EXPECT_EQ(mix.at(V2f(0, 0)), Rgb(0.5F, 0, 0.5F)) << "no normal: half and half";
    EXPECT_THAT(refusal_of_world("Texture \"t\" \"float\" \"directionmix\" \"vector3 dir\" [0 0 0]"),
                HasSubstr("has no length"));
}

TEST(Textures, Nested_ToAnyDepth) {
    std::string before = "Texture \"0\" \"spectrum\" \"checkerboard\" ";
    for (int i = 1; i <= 100; ++i) {
        before += "Texture \"" + std::to_string(i) + "\" \"spectrum\" \"scale\" \"texture tex1\" \"" +
                  std::to_string(i - 1) + "\" \"rgb tex2\" [.5 1 1] ";
    }
    const auto texture = color("\"scale\" \"texture tex\" \"100\" \"float scale\" 0.5", before);
    EXPECT_FLOAT_EQ(texture.at(V2f(0.5F, 0.5F)).x, std::pow(0.5F, 101.0F));
    EXPECT_FLOAT_EQ(texture.at(V2f(0.5F, 0.5F)).y, 0.5F);
    EXPECT_EQ(texture.at(V2f(1.5F, 0.5F)), Rgb(0.0F));
}

TEST(Textures, NamesOfFloatsAndColours_AreApart) {
    const auto texture = color("\"scale\" \"texture tex\" \"a\" \"texture scale\" \"a\"",
                               "Texture \"a\" \"float\" \"constant\" \"float value\" .5 "
                               "Texture \"a\" \"color\" \"constant\" \"rgb value\" [.2 .4 .8]");
    EXPECT_EQ(texture.at(V2f(0, 0)), Rgb(0.1F, 0.2F, 0.4F));
}

TEST(Textures, Mappings_FollowTheTransformationOfTheirPlace) {
    const std::string board = "\"checkerboard\" \"string mapping\" ";
    const auto planar =
        color(board + "\"planar\" \"vector3 v1\" [0 0 1] \"vector3 v2\" [1 0 0] \"float udelta\" .5",
              "Translate 10 0 0 Scale 2 2 2");
    EXPECT_EQ(planar.at({V2f(0, 0), V3d(11, 5, 0.5)}), Rgb(1.0F)) << "s = 0.75, t = 0.5";
    EXPECT_EQ(planar.at({V2f(0, 0), V3d(11, 5, 1.5)}), Rgb(0.0F)) << "s = 1.25";
    EXPECT_EQ(planar.at({V2f(0, 0), V3d(9, 5, 0.5)}), Rgb(0.0F)) << "t = -0.5";
    const auto spherical = color("\"uv\" \"string mapping\" \"spherical\"", "Translate 0 0 5");
    const Rgb at_y = spherical.at({V2f(0, 0), V3d(0, 3, 5)});
    EXPECT_FLOAT_EQ(at_y.x, 0.5F) << "the equator";
    EXPECT_FLOAT_EQ(at_y.y, 0.25F) << "a quarter of the way round from x";
    const auto cylindrical = color("\"uv\" \"string mapping\" \"cylindrical\"");
    EXPECT_FLOAT_EQ(cylindrical.at({V2f(0, 0), V3d(7, 0, 2.25)}).x, 0.5F);
    EXPECT_FLOAT_EQ(cylindrical.at({V2f(0, 0), V3d(7, 0, 2.25)}).y, 0.25F);
    EXPECT_THAT(refusal_of_world("Texture \"t\" \"color\" \"uv\" \"string mapping\" \"sferical\""),
                HasSubstr("did you mean \"spherical\"?"));
}

TEST(Textures, CheckerboardInSpace_HasCubes) {
    const auto board = color("\"checkerboard\" \"integer dimension\" 3", "Scale 2 2 2");
    EXPECT_EQ(board.at({V2f(0, 0), V3d(1, 1, 1)}), Rgb(1.0F));
    EXPECT_EQ(board.at({V2f(0, 0), V3d(3, 1, 1)}), Rgb(0.0F));
    EXPECT_EQ(board.at({V2f(0, 0), V3d(3, 3, 1)}), Rgb(1.0F));
    EXPECT_EQ(board.at({V2f(0, 0), V3d(3, 3, -1)}), Rgb(0.0F));
}

TEST(Textures, Bilerp_IsLinearBetweenItsCorners) {
    const auto texture =
        color("\"bilerp\" \"rgb v00\" [0 0 0] \"rgb v01\" [0 1 0] \"rgb v10\" [1 0 0] \"rgb v11\" [1 1 0]");
    EXPECT_EQ(texture.at(V2f(0.25F, 0.75F)), Rgb(0.25F, 0.75F, 0));
}

TEST(Textures, Noise_IsReadForColoursAndNumbers) {
    for (const std::string kind :
         {"fbm", "wrinkled", "windy", "marble", "dots", "uv", "checkerboard", "bilerp"}) {
        const std::string declared =
            "Texture \"c\" \"spectrum\" \"" + kind + "\" Texture \"f\" \"float\" \"" + kind + "\"";
        EXPECT_EQ(refusal_of_world(declared), "") << kind;
        EXPECT_TRUE(read_world(declared).warnings.empty()) << kind;
    }
    const std::string with =
        "\"marble\" \"integer octaves\" 4 \"float roughness\" .3 \"float scale\" 2 \"float variation\" 1";
    EXPECT_NE(color(with).at({V2f(0, 0), V3d(0.3, 0.4, 0.5)}),
              color("\"marble\"").at({V2f(0, 0), V3d(0.3, 0.4, 0.5)}));
    EXPECT_THAT(refusal_of_world("Texture \"t\" \"float\" \"fbm\" \"integer octaves\" 65"),
                HasSubstr("octaves 65 is not accepted"));
}

struct OneImage {
    TemporaryFolder folder;
    OneImage() {
        Image image = Image::rgb(2, 1);  // bytes 128 and 64
        image.set_rgb(0, 0, Rgb(128.0F / 255));
        image.set_rgb(1, 0, Rgb(64.0F / 255));
        write_png_display(folder / "t.png", image);
    }
    float at(const std::string& parameters, float u, const std::string& file = "t.png", bool skip = false) {
        RecordingMonitor monitor;
        SceneOverrides overrides;
        overrides.skip_missing = skip;
        const std::string world = "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + file +
                                  "\" " + parameters +
                                  " Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"";
        const Draft draft = read_draft(std::string(kHead) + world, folder / "scene.pbrt", overrides, monitor);
        warnings = monitor.warnings;
        return std::get<DiffuseMaterial>(draft.materials.at(0).model).reflectance.at(V2f(u, 0.5F)).x;
    }
    std::vector<std::string> warnings;
};

TEST(Textures, Imagemap_TakesWrapEncodingScaleAndInvert) {
    OneImage image;
    EXPECT_NEAR(image.at("", 0.25F), 0.2158605F, 1e-6F) << "sRGB";
    EXPECT_NEAR(image.at("", 1.25F), 0.2158605F, 1e-6F) << "repeats";
    EXPECT_NEAR(image.at("\"string encoding\" \"linear\"", 0.25F), 128.0F / 255, 1e-6F);
    EXPECT_NEAR(image.at("\"bool gamma\" false", 0.25F), 128.0F / 255, 1e-6F) << "version 3";
    EXPECT_NEAR(image.at("\"string encoding\" \"gamma 2\"", 0.25F), std::pow(128.0F / 255, 2.0F), 1e-6F);
    EXPECT_NEAR(image.at("\"string encoding\" \"linear\" \"float scale\" 0.5 \"bool invert\" true", 0.25F),
                1 - 64.0F / 255, 1e-6F);
    EXPECT_NEAR(image.at("\"string encoding\" \"linear\" \"string wrap\" \"clamp\"", 3), 64.0F / 255, 1e-6F);
    EXPECT_NEAR(image.at("\"string encoding\" \"linear\" \"string wrap\" \"black\"", 3), 0, 1e-6F);
    EXPECT_TRUE(
        image.at("\"bool trilinear\" true \"float maxanisotropy\" 8 \"string filter\" \"ewa\"", 0.25F) > 0 &&
        image.warnings.empty());
    image.at("\"string wrap\" \"octahedralsphere\"", 0.25F);
    EXPECT_THAT(image.warnings.at(0), HasSubstr("clamp is used"));
}

TEST(Textures, MissingImage_IsRefusedOrGrey) {
    OneImage image;
    EXPECT_THAT(error_of([&] { image.at("", 0, "no.png"); }), HasSubstr("no.png: no such file"));
    EXPECT_EQ(image.at("", 0, "no.png", true), 0.5F);
    EXPECT_THAT(image.warnings.at(0), HasSubstr("no.png: the file is missing; grey is used"));
}

TEST(Textures, WhatTheyCannotDo_IsRefused) {
    const auto refused = [](const std::string& text) {
        return refusal_of_world("Texture \"t\" \"spectrum\" " + text);
    };
    EXPECT_THAT(refused("\"ptex\""), HasSubstr("Texture \"ptex\" is not supported"));
    EXPECT_THAT(refused("\"marbel\""), HasSubstr("did you mean \"marble\"?"));
    EXPECT_THAT(refused("\"imagemap\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refused("\"imagemap\" \"string filename\" \"a\" \"string wrap\" \"mirror\""),
                HasSubstr("wrap \"mirror\" is unknown"));
    EXPECT_THAT(refused("\"imagemap\" \"string filename\" \"a\" \"string encoding\" \"gamma 0\""),
                HasSubstr("encoding \"gamma 0\" is unknown"));
    EXPECT_THAT(refused("\"checkerboard\" \"integer dimension\" 4"),
                HasSubstr("4 is not accepted; expected 2 or 3"));
    EXPECT_THAT(refused("\"checkerboard\" \"texture tex1\" \"no\""),
                HasSubstr("there is no texture \"no\" of colours"));
    EXPECT_THAT(refused("\"checkerboard\" Texture \"u\" \"float\" \"scale\" \"texture tex1\" \"t\""),
                HasSubstr("there is no texture \"t\" of floats"));
    EXPECT_THAT(refused("\"uv\" Texture \"u\" \"color\" \"bilerp\" \"texture v00\" \"t\""),
                HasSubstr("\"v00\" of Texture \"bilerp\": expected a constant"));
    EXPECT_THAT(refusal_of_world("Material \"matte\" \"texture Kd\" \"t\""),
                HasSubstr("there is no colour texture \"t\""));
}

}  // namespace textures_test
}  // namespace lucerna
