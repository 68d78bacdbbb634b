// Lights as the scene text gives them, and as they are built.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/pbrt/transforms.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace {

using namespace lucerna::testing;
using ::testing::HasSubstr;

constexpr std::string_view kSquare =
    "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point3 P\" [0 0 0 1 0 0 1 1 0 0 1 0] ";

template <typename Spec>
Spec only(std::string_view world) {
    return std::get<Spec>(read_world(world).draft.lights.at(0).spec);
}

double power_of(std::string_view world) {
    return parts_of_world(world).lights.at(0)->power();
}

TEST(Lights, Point_StandsWhereItsTransformationPutsIt) {
    const auto point = only<PointSpec>(
        "Translate 1 0 0 Scale 2 2 2 LightSource \"point\" \"rgb I\" [1 2 3] \"float scale\" 2 \"point "
        "from\" [1 1 1]");
    EXPECT_EQ(point.position, V3d(3, 2, 2));
    EXPECT_EQ(point.intensity, Rgb(2, 4, 6));
    EXPECT_EQ(only<PointSpec>("LightSource \"point\"").intensity, Rgb(1.0F)) << "pbrt's default";
    EXPECT_EQ(only<PointSpec>("LightSource \"point\" \"color scale\" [1 .5 0]").intensity, Rgb(1, 0.5F, 0))
        << "version 3";
}

TEST(Lights, Power_SetsTheLuminanceOfTheFlux) {
    EXPECT_NEAR(power_of("LightSource \"point\" \"rgb I\" [1 2 3] \"float power\" 60"), 60, 1e-4);
    EXPECT_NEAR(power_of("LightSource \"spot\" \"rgb I\" [1 2 3] \"float power\" 60 \"float coneangle\" 20"),
                60, 1e-4);
    EXPECT_NEAR(power_of("AreaLightSource \"diffuse\" \"float power\" 60 \"bool twosided\" true " +
                         std::string(kSquare)),
                60, 1e-4);
    EXPECT_NEAR(power_of("Scale 3 3 3 AreaLightSource \"diffuse\" \"float power\" 60 Shape \"sphere\""), 60,
                1e-4);
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"float power\" 0"), HasSubstr("0 is not accepted"));
    EXPECT_THROW(parts_of_world("LightSource \"point\" \"rgb I\" [0 0 0] \"float power\" 1"), InputError);
}

TEST(Lights, Spot_TakesDirectionAndAngles) {
    const auto spot = only<SpotSpec>(
        "Translate 5 0 0 LightSource \"spot\" \"point3 from\" [0 1 0] \"point3 to\" [0 0 0]"
        "\"float coneangle\" 40 \"float conedeltaangle\" 10");
    EXPECT_EQ(spot.position, V3d(5, 1, 0));
    EXPECT_EQ(spot.axis, V3d(0, -1, 0));
    EXPECT_EQ(spot.cone_degrees, 40);
    EXPECT_EQ(spot.delta_degrees, 10);
    const auto plain = only<SpotSpec>("LightSource \"spot\"");
    EXPECT_EQ(plain.axis, V3d(0, 0, 1));
    EXPECT_EQ(plain.cone_degrees, 30);
    EXPECT_EQ(plain.delta_degrees, 5);
    EXPECT_THAT(refusal_of_world("LightSource \"spot\" \"float coneangle\" 3"),
                HasSubstr("exceeds coneangle 3"));
    EXPECT_THAT(refusal_of_world("LightSource \"spot\" \"point3 to\" [0 0 0]"),
                HasSubstr("are the same point"));
}

TEST(Lights, Distant_TravelsFromFromToTo) {
    const auto sun = only<DistantSpec>(
        "LightSource \"distant\" \"point from\" [0 2 1] \"rgb L\" [1 1 1] "
        "\"float illuminance\" 500 \"float scale\" 2");
    EXPECT_EQ(sun.direction, V3d(0, -1, 0));
    EXPECT_NEAR(luminance(sun.irradiance), 1000, 1e-3);
    EXPECT_EQ(only<DistantSpec>("LightSource \"distant\"").direction, V3d(0, 0, 1));
}

TEST(Lights, Infinite_IsAConstantSky) {
    EXPECT_EQ(
        only<InfiniteSpec>("LightSource \"infinite\" \"rgb L\" [.8 .8 .8] \"integer nsamples\" 32").radiance,
        Rgb(0.8F));
    EXPECT_NEAR(
        luminance(only<InfiniteSpec>("LightSource \"infinite\" \"float illuminance\" 3.14159265").radiance),
        1, 1e-5);
    EXPECT_THAT(refusal_of_world("LightSource \"infinite\" \"string mapname\" \"sky.exr\""),
                HasSubstr("with \"mapname\" is not supported yet"));
}

TEST(Lights, Area_IsTakenUpByTheShapesOfItsBlock) {
    const Read read =
        read_world("AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [17 12 4] \"float scale\" 2 " +
                   std::string(kSquare) + "Shape \"disk\" AttributeEnd " + std::string(kSquare));
    ASSERT_EQ(read.draft.lights.size(), 2U);
    EXPECT_EQ(read.draft.meshes.at(0).traits.light, 0);
    EXPECT_EQ(read.draft.quadrics.at(0).traits.light, 1);
    EXPECT_EQ(read.draft.meshes.at(1).traits.light, kNoLight);
    const auto area = std::get<AreaSpec>(read.draft.lights[0].spec);
    EXPECT_EQ(area.radiance, Rgb(34, 24, 8));
    EXPECT_FALSE(area.two_sided);
    EXPECT_TRUE(read.warnings.empty());
}

TEST(Lights, AreaFlux_IsPiTimesAreaTimesRadiance) {
    const double pi = 3.14159265358979;
    EXPECT_NEAR(power_of("Scale 2 3 1 AreaLightSource \"diffuse\" " + std::string(kSquare)), 6 * pi, 1e-4);
    EXPECT_NEAR(power_of("Scale 2 2 2 AreaLightSource \"diffuse\" Shape \"sphere\""), 16 * pi * pi, 1e-3);
    EXPECT_NEAR(power_of("Scale 2 2 2 AreaLightSource \"diffuse\" \"bool twosided\" \"true\" Shape \"disk\" "
                         "\"float innerradius\" 0.5"),
                2 * 3 * pi * pi, 1e-3);
}

// The emitting side of area lights is that of the geometry, whatever turned it.
TEST(Lights, AreaEmission_LeavesOnTheSideOfTheGeometry) {
    const std::string normals = " \"normal3 N\" [0 0 -1 0 0 -1 0 0 -1 0 0 -1] ";
    for (const std::string turn : {"", "ReverseOrientation ", "Scale 1 1 -1 ",
                                   "ReverseOrientation Scale 1 1 -1 ", "Scale 2 2 2 Rotate 40 1 2 3 "}) {
        for (const std::string& shape :
             {std::string(kSquare), std::string(kSquare) + normals, std::string("Shape \"sphere\" "),
              std::string("Shape \"disk\" \"float height\" 2 ")}) {
            SceneParts parts = parts_of_world(turn + "AreaLightSource \"diffuse\" " + shape);
            const Scene scene(std::move(parts), {1});
            const auto photon = scene.lights()[0]->emit({{0.3F, 0.6F}, {0.4F, 0.7F}});
            ASSERT_TRUE(photon.has_value());
            // A ray that comes back along the photon's way meets the surface where it left, from its outside.
            const float back = 1e-3F;
            const auto hit = scene.hit({photon->from.p + back * photon->d, -photon->d});
            ASSERT_TRUE(hit.has_value()) << turn << shape;
            EXPECT_GT(hit->at.n.dot(photon->d), 0) << turn << shape;
            EXPECT_EQ(hit->light, 0);
            EXPECT_NEAR((hit->at.p - photon->from.p).length(), 0, 1e-5F);
            const Seen seen =
                scene.lights()[0]->meet({photon->from.p + back * photon->d, -photon->d}, hit->t, hit->at.n);
            EXPECT_EQ(seen.radiance, Rgb(1.0F)) << turn << shape;
        }
    }
}

TEST(Lights, UnfitEmitters_AreRefused) {
    const std::string area = "AreaLightSource \"diffuse\" ";
    EXPECT_THAT(refusal_of_world(area + "Scale 1 2 1 Shape \"sphere\""),
                HasSubstr("is stretched or sheared"));
    EXPECT_THAT(refusal_of_world(area + "Shape \"sphere\" \"float zmax\" 0"), HasSubstr("is only a part"));
    EXPECT_THAT(refusal_of_world(area + "Shape \"disk\" \"float phimax\" 90"), HasSubstr("is only a part"));
    EXPECT_EQ(refusal_of_world("Scale 1 2 1 Shape \"sphere\""), "") << "as geometry it is welcome";
    EXPECT_THAT(refusal_of_world("AreaLightSource \"diffuse\" \"string filename\" \"x.png\""),
                HasSubstr("not supported"));
    EXPECT_THAT(refusal_of_world("AreaLightSource \"difuse\""), HasSubstr("did you mean \"diffuse\"?"));
}

TEST(Lights, AreaOfInterface_EmitsNothingWithAWarning) {
    const Read read = read_world("Material \"interface\" AreaLightSource \"diffuse\" Shape \"sphere\"");
    EXPECT_TRUE(read.draft.lights.empty());
    EXPECT_THAT(read.warnings.at(0), HasSubstr("it emits nothing"));
}

TEST(Lights, LightField_TakesFileScalePowerAndMode) {
    const auto lamp = only<MeasuredSpec>(
                          "Translate 1 2 3 Scale 2 2 2 LightSource \"lightfield\" "
                          "\"string filename\" \"lamp.exr\" \"float power\" 1500 \"string emission\" "
                          "\"weighted\"")
                          .settings;
    EXPECT_EQ(lamp.file, "lamp.exr");
    EXPECT_EQ(lamp.power, 1500);
    EXPECT_EQ(lamp.power_scale, 1);
    EXPECT_EQ(lamp.mode, EmissionMode::weighted);
    EXPECT_EQ(lamp.world_from_light.translation(), V3d(1, 2, 3));
    const std::string with = "LightSource \"lightfield\" \"string filename\" \"lamp.exr\" ";
    EXPECT_EQ(only<MeasuredSpec>(with).settings.mode, EmissionMode::exact);
    EXPECT_THAT(refusal_of_world("LightSource \"lightfield\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world(with + "\"string emission\" \"exakt\""),
                HasSubstr("emission \"exakt\" is unknown; constant, exact and weighted are accepted"));
    EXPECT_THAT(refusal_of_world("Scale 1 1 2 " + with), HasSubstr("stretched"));
    EXPECT_THAT(refusal_of_world("Scale -1 1 1 " + with), HasSubstr("mirrored"));
    EXPECT_THAT(refusal_of_world(with + "\"float scale\" -1"), HasSubstr("-1 is not accepted"));
}

TEST(Lights, MissingLampFile_IsRefusedAtItsPlace) {
    try {
        parts_of_world("LightSource \"lightfield\" \"string filename\" \"lamp.exr\"");
        FAIL();
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr("scene.pbrt:2:1: "));
        EXPECT_THAT(error.what(), HasSubstr("lamp.exr"));
    }
}

TEST(Lights, DarkScenes_AreWarnedOf) {
    RecordingMonitor monitor;
    assemble(
        read_draft(std::string(kHead) + "LightSource \"point\" \"rgb I\" [0 0 0]", "scene.pbrt", {}, monitor),
        {1}, monitor);
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre("scene.pbrt:2:1: this point light has no power"));
    monitor.warnings.clear();
    assemble(read_draft(std::string(kHead), "scene.pbrt", {}, monitor), {1}, monitor);
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre("scene.pbrt: the scene has no light"));
}

TEST(Lights, BadColours_AreRefused) {
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"rgb I\" [1 -2 3]"),
                HasSubstr("scene.pbrt:2:32: \"rgb I\": -2 is not accepted"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"rgb I\" [1 1e39 3]"),
                HasSubstr("1e+39 is not accepted"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"blackbody I\" 3000"),
                HasSubstr("blackbody is not supported yet"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" [400 1 700 1]"),
                HasSubstr("a list of wavelengths and values is not supported yet"));
    EXPECT_THAT(refusal_of_world("LightSource \"projection\""), HasSubstr("is not supported yet"));
}

}  // namespace
}  // namespace lucerna
