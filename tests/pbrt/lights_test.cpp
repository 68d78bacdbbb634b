// Lights as the scene text gives them, and as they are built.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/image/image.h"
#include "engine/pbrt/transforms.h"
#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lights_test {

using namespace lucerna::testing;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

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

// The light's distance or its square overflows a float, so the image would be black without a warning.
TEST(Lights, FartherThanAFloatReaches_IsRefused) {
    const std::string sphere = "Shape \"sphere\" ";
    for (const char* light : {"LightSource \"point\" ", "LightSource \"spot\" \"point3 to\" [ 0 1 0 ] "}) {
        for (const char* x : {"1e39", "-1e39", "1e300", "1e20", "1.1e15"}) {
            const std::string from = fmt::format("\"point3 from\" [ {} 0 0 ]", x);
            EXPECT_THAT(error_of([&] { parts_of_world(sphere + light + from); }),
                        HasSubstr("the limit is 1e+15"))
                << light << x;
        }
        EXPECT_THAT(error_of([&] { parts_of_world(sphere + "Translate 0 1e39 0 " + light); }),
                    HasSubstr("the light is 1e+39 away"));
        EXPECT_NO_THROW(parts_of_world(sphere + light + "\"point3 from\" [ 0.9e15 0 0 ]"));
    }
    EXPECT_THAT(error_of([&] { parts_of_world("LightSource \"point\" \"point3 from\" [ 1e39 0 0 ]"); }),
                HasSubstr("the limit is 1e+30"));
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
    const Read narrow = read_world("LightSource \"spot\" \"float coneangle\" 3");
    EXPECT_THAT(narrow.warnings.at(0), HasSubstr("conedeltaangle 5 exceeds coneangle 3"));
    EXPECT_EQ(std::get<SpotSpec>(narrow.draft.lights.at(0).spec).delta_degrees, 3);
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
    for (const std::string name : {"infinitesample", "exinfinite"}) {
        EXPECT_EQ(only<InfiniteSpec>("LightSource \"" + name + "\" \"rgb L\" [1 2 3]").radiance,
                  Rgb(1, 2, 3));
    }
    EXPECT_THAT(refusal_of_world("LightSource \"infinite\" \"point3 portal\" [0 0 0 1 0 0 1 1 0 0 1 0]"),
                HasSubstr("scene.pbrt:2:24: \"portal\" of LightSource \"infinite\" is not supported"));
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

// As in pbrt-v4, "power" sets the strength of the light and "scale" multiplies it.
TEST(Lights, PowerAndScale_BothCount) {
    const TemporaryFolder folder;
    Image slide = Image::rgb(4, 4);
    for (std::size_t i = 0; i < slide.data.size(); ++i) slide.data[i] = static_cast<float>(i % 5);
    write_exr(folder.path() / "slide.exr", slide);
    const std::string image = "\"string filename\" \"" + (folder.path() / "slide.exr").string() + "\" ";
    const std::string web =
        "\"string filename\" \"" LUCERNA_SOURCE_DIR "/tests/cli/faults/photometric/disc95.ies\" ";
    for (const std::string& light :
         {std::string("LightSource \"point\" \"rgb I\" [1 2 3] "),
          std::string("LightSource \"spot\" \"float coneangle\" 20 "),
          std::string("LightSource \"spot\" \"string falloff\" \"quadratic\" "),
          std::string("LightSource \"goniometric\" "), "LightSource \"goniometric\" " + image,
          "LightSource \"projection\" " + image, "LightSource \"ies\" \"rgb color\" [1 0.5 0.2] " + web,
          std::string("AreaLightSource \"diffuse\" \"rgb L\" [4 2 1] ")}) {
        const std::string shape = light.starts_with("Area") ? " Shape \"disk\"" : "";
        EXPECT_NEAR(power_of(light + "\"float power\" 500" + shape), 500, 5e-3) << light;
        EXPECT_NEAR(power_of(light + "\"float power\" 500 \"float scale\" 2" + shape), 1000, 1e-2) << light;
        EXPECT_NEAR(power_of(light + "\"float scale\" 0.25 \"float power\" 500" + shape), 125, 1e-3) << light;
        EXPECT_NEAR(power_of(light + "\"float scale\" 3" + shape), 3 * power_of(light + shape),
                    1e-5 * power_of(light + shape))
            << light;
    }
    EXPECT_NEAR(power_of("LightSource \"point\" \"float power\" 500 \"float scale\" 0"), 0, 0);
}

TEST(Lights, UnknownParameter_IsRefusedWithAllThatAreKnown) {
    const std::string refused = refusal_of_world(
        "LightSource \"lightfield\" \"string filename\" \"lamp.exr\" \"float efficacity\" 3");
    EXPECT_THAT(refused, HasSubstr("did you mean \"efficacy\"?"));
    for (const char* name :
         {"filename", "scale", "power", "efficacy", "emission", "reconstruction", "lightgroup"})
        EXPECT_THAT(refused, HasSubstr(name));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"float powr\" 3"),
                HasSubstr("did you mean \"power\"?"));
    EXPECT_THAT(refusal_of_world("LightSource \"distant\" \"float illuminence\" 3"),
                HasSubstr("did you mean \"illuminance\"?"));
    EXPECT_THAT(refusal_of_world("LightSource \"spot\" \"string falloff\" \"smooth\""),
                HasSubstr("falloff \"smooth\" is unknown; expected smoothstep or quadratic"));
}

TEST(Lights, AreaFlux_IsPiTimesAreaTimesRadiance) {
    const double pi = 3.14159265358979;
    EXPECT_NEAR(power_of("Scale 2 3 1 AreaLightSource \"diffuse\" " + std::string(kSquare)), 6 * pi, 1e-4);
    EXPECT_NEAR(power_of("Scale 2 2 2 AreaLightSource \"diffuse\" Shape \"sphere\""), 16 * pi * pi, 1e-3);
    EXPECT_NEAR(power_of("Scale 2 2 2 AreaLightSource \"diffuse\" \"bool twosided\" \"true\" Shape \"disk\" "
                         "\"float innerradius\" 0.5"),
                2 * 3 * pi * pi, 1e-3);
}

// Area lights emit on the geometry's outside, whatever transformation or orientation flips it.
TEST(Lights, AreaEmission_LeavesOnTheSideOfTheGeometry) {
    const std::string normals = " \"normal3 N\" [0 0 -1 0 0 -1 0 0 -1 0 0 -1] ";
    for (const std::string turn : {"", "ReverseOrientation ", "Scale 1 1 -1 ",
                                   "ReverseOrientation Scale 1 1 -1 ", "Scale 2 2 2 Rotate 40 1 2 3 "}) {
        for (const std::string& shape :
             {std::string(kSquare), std::string(kSquare) + normals, std::string("Shape \"sphere\" "),
              std::string("Shape \"disk\" \"float height\" 2 ")}) {
            SceneParts parts = parts_of_world(turn + "AreaLightSource \"diffuse\" " + shape);
            const Scene scene(std::move(parts), {1});
            const auto photon = scene.lights()[0]->sample_Le({{0.3F, 0.6F}, {0.4F, 0.7F}});
            ASSERT_TRUE(photon.has_value());
            // A ray back along the photon's path hits the surface where the photon leaves, from the outside.
            const float back = 1e-3F;
            const auto hit = scene.intersect({photon->from.p + back * photon->d, -photon->d});
            ASSERT_TRUE(hit.has_value()) << turn << shape;
            EXPECT_GT(hit->at.n.dot(photon->d), 0) << turn << shape;
            EXPECT_EQ(hit->light, 0);
            EXPECT_NEAR((hit->at.p - photon->from.p).length(), 0, 1e-5F);
            const EmittedRadiance seen = scene.lights()[0]->Le_on_surface(
                {photon->from.p + back * photon->d, -photon->d}, hit->t, hit->at.n, hit->primitive);
            EXPECT_EQ(seen.radiance, Rgb(1.0F)) << turn << shape;
        }
    }
}

TEST(Lights, UnfitEmitters_AreRefused) {
    const std::string area = "AreaLightSource \"diffuse\" ";
    // Any surface may emit; one without a closed form does so as triangles.
    EXPECT_EQ(refusal_of_world(area + "Scale 1 2 1 Shape \"sphere\""), "");
    EXPECT_EQ(refusal_of_world(area + "Shape \"disk\" \"float phimax\" 90"), "");
    EXPECT_THAT(refusal_of_world("AreaLightSource \"diffuse\" \"string filename\" \"x.png\""),
                HasSubstr("x.png: no such file"));
    EXPECT_THAT(refusal_of_world("AreaLightSource \"difuse\""), HasSubstr("did you mean \"diffuse\"?"));
}

TEST(Lights, AreaOfInterface_EmitsNothingWithAWarning) {
    const Read read = read_world("Material \"interface\" AreaLightSource \"diffuse\" Shape \"sphere\"");
    EXPECT_TRUE(read.draft.lights.empty());
    EXPECT_THAT(read.warnings.at(0), HasSubstr("it emits nothing"));
}

TEST(Lights, RemovedEmission_IsExactWithAWarning) {
    const Read read = read_world(
        "LightSource \"lightfield\" \"string filename\" \"lamp.exr\" \"string emission\" \"weighted\"");
    EXPECT_EQ(std::get<MeasuredSpec>(read.draft.lights.at(0).spec).settings.mode, EmissionMode::exact);
    EXPECT_THAT(read.warnings.at(0), HasSubstr("\"weighted\" has been removed"));
}

TEST(Lights, LightField_TakesFileScalePowerAndMode) {
    const auto lamp = only<MeasuredSpec>(
                          "Translate 1 2 3 Scale 2 2 2 LightSource \"lightfield\" "
                          "\"string filename\" \"lamp.exr\" \"float power\" 1500 \"string emission\" "
                          "\"constant\"")
                          .settings;
    EXPECT_EQ(lamp.file, "lamp.exr");
    EXPECT_EQ(lamp.power, 1500);
    EXPECT_EQ(lamp.power_scale, 1);
    EXPECT_EQ(lamp.mode, EmissionMode::constant);
    EXPECT_EQ(lamp.world_from_light.translation(), V3d(1, 2, 3));
    const std::string with = "LightSource \"lightfield\" \"string filename\" \"lamp.exr\" ";
    EXPECT_EQ(only<MeasuredSpec>(with).settings.mode, EmissionMode::exact);
    EXPECT_THAT(refusal_of_world("LightSource \"lightfield\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world(with + "\"string emission\" \"exakt\""),
                HasSubstr("emission \"exakt\" is unknown; expected constant or exact"));
    EXPECT_THAT(refusal_of_world(with + "\"string reconstruction\" \"rough\""),
                HasSubstr("reconstruction \"rough\" is unknown; expected exact or approximate"));
    EXPECT_THAT(refusal_of_world(with + "\"string reconstruction\" \"approximate\" \"string emission\" "
                                        "\"constant\""),
                HasSubstr("with emission \"exact\" only"));
    EXPECT_THAT(refusal_of_world("Scale 1 1 2 " + with), HasSubstr("stretched"));
    EXPECT_THAT(refusal_of_world("Scale -1 1 1 " + with), HasSubstr("mirrored"));
    EXPECT_THAT(refusal_of_world(with + "\"float scale\" -1"), HasSubstr("-1 is not accepted"));
}

TEST(Lights, RayFile_TakesFileScaleAndPower) {
    const auto lamp = only<RayFileSpec>(
                          "Translate 1 2 3 LightSource \"rayfile\" \"string filename\" \"lamp.tm25ray\" "
                          "\"float scale\" 2")
                          .settings;
    EXPECT_EQ(lamp.file, "lamp.tm25ray");
    EXPECT_EQ(lamp.power, 0);
    EXPECT_EQ(lamp.power_scale, 2);
    EXPECT_EQ(lamp.world_from_light.translation(), V3d(1, 2, 3));
    EXPECT_THAT(refusal_of_world("LightSource \"rayfile\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world("Scale -1 1 1 LightSource \"rayfile\" \"string filename\" \"lamp.dat\""),
                HasSubstr("mirrored"));
    EXPECT_THAT(refusal_of_world("LightSource \"rayfiles\""), HasSubstr("did you mean \"rayfile\"?"));
}

TEST(Lights, LightFieldOnAShape_TakesThatShapeAndItsOwnFrame) {
    const TemporaryFolder folder;
    Rig rig;
    rig.views = rig.pixels = {2, 2};
    rig.spacing = rig.pixel = {0.01, 0.01};
    rig.distance = 0.05;
    write_light_field(folder / "lamp.exr", LightField(rig, std::vector<float>(16, 1.0F)));
    const std::string with =
        "AreaLightSource \"lightfield\" \"string filename\" \"" + (folder / "lamp.exr").string() + "\" ";
    for (const char* shape :
         {"Shape \"sphere\" \"float radius\" 0.5 ",
          "Shape \"cylinder\" \"float radius\" 0.5 \"float zmin\" -1 \"float zmax\" 1 "}) {
        // The shape's own transformation does not rotate the lamp.
        const SceneParts parts =
            parts_of_world("AttributeBegin Translate 0 0 3 " + with + "AttributeBegin Rotate 90 1 0 0 " +
                           shape + "AttributeEnd AttributeEnd");
        ASSERT_EQ(parts.lights.size(), 1U);
        EXPECT_EQ(parts.lights[0]->kind(), "lightfield");
        EXPECT_GT(parts.lights[0]->power(), 0);
        const auto particle = parts.lights[0]->sample_Le({{0.5F, 0.5F}, {0.5F, 0.5F}});
        ASSERT_TRUE(particle);
        EXPECT_NEAR(static_cast<double>(particle->from.p.z) + parts.origin.z, 3.5, 0.02);
        EXPECT_GT(particle->d.z, 0.9F);
        EXPECT_EQ(parts.quadrics.empty() ? parts.meshes[0].traits.light : parts.quadrics[0].traits.light, 0);
    }
    EXPECT_THAT(refusal_of_world(with + "Shape \"sphere\" Shape \"sphere\""), HasSubstr("by one shape only"));
    EXPECT_THAT(refusal_of_world("AreaLightSource \"lightfield\" Shape \"sphere\""),
                HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world("Scale 1 1 2 " + with + "Shape \"sphere\""), HasSubstr("stretched"));
    EXPECT_TRUE(read_world(with).draft.lights.empty()) << "it waits for a shape";
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
    assemble(read_draft(std::string(kHead) + "Shape \"sphere\" LightSource \"point\" \"rgb I\" [0 0 0]",
                        "scene.pbrt", {}, monitor),
             {1}, monitor);
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre("scene.pbrt:2:16: this point light has no power"));
    monitor.warnings.clear();
    assemble(read_draft(std::string(kHead) + "Shape \"sphere\"", "scene.pbrt", {}, monitor), {1}, monitor);
    EXPECT_THAT(monitor.warnings, ::testing::ElementsAre("scene.pbrt: the scene has no light"));
}

Rgb color_of(const std::string& parameter) {
    return only<PointSpec>("LightSource \"point\" \"" + parameter).intensity;
}

TEST(Lights, Colours_OfEverySpelling_AreTaken) {
    EXPECT_NEAR(luminance(color_of("spectrum I\" [400 5 700 5]")), 5, 1e-4) << "numbers as they stand";
    EXPECT_GT(color_of("spectrum I\" [400 5 700 5]").x, 5.5F) << "equal energy is pink";
    EXPECT_NEAR(luminance(color_of("spectrum I\" \"stdillum-D65\"")), 1, 1e-5);
    const Rgb white = color_of("spectrum I\" \"stdillum-D65\"");
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(white[c], 1, 0.01) << c;
    // Version 4 normalises luminance to 1. In version 3 the largest spectral value is the scale; at 2900 K it
    // lies at 1 µm.
    const Rgb warm = color_of("blackbody I\" 2900");
    EXPECT_NEAR(luminance(warm), 1, 1e-5);
    EXPECT_GT(warm.x, 2.0F * warm.z);
    const Rgb scaled = color_of("blackbody I\" [2900 3]");
    EXPECT_LT(luminance(scaled), 1.5F);
    EXPECT_NEAR(scaled.x / luminance(scaled), warm.x, 1e-4);
    const Rgb xyz = color_of("xyz I\" [1.90094 2 2.17766]");
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(xyz[c], 2, 0.01) << c;
}

TEST(Lights, ColourSpace_IsThatOfTheNumbersUntilTheBlockEnds) {
    const auto lights = [](const std::string& text) {
        std::vector<Rgb> colours;
        for (const auto& light : parts_of_world(text).lights)
            colours.push_back(light->flux() * static_cast<float>(1 / (4 * M_PI)));
        return std::pair(colours, read_world(text).warnings);
    };
    const std::string light = "LightSource \"point\" \"rgb I\" [ 0.4 0.5 0.2 ]\n";
    const auto [colours, warnings] =
        lights("AttributeBegin ColorSpace \"rec2020\"\n" + light +
               "Attribute \"light\" \"rgb I\" [ 0.4 0.5 0.2 ] ColorSpace \"srgb\" LightSource \"point\"\n"
               "LightSource \"point\" \"rgb I\" [ 0.4 0.5 0.2 ]\n"
               "ColorSpace \"acescg\" LightSource \"point\" \"rgb I\" [ 2 2 2 ]\nAttributeEnd\n" +
               light);
    ASSERT_EQ(colours.size(), 5U);
    // The matrix of ITU-R BT.2087 is applied by hand; white stays white.
    const Rgb wide(1.6605F * 0.4F - 0.5876F * 0.5F - 0.0728F * 0.2F,
                   -0.1246F * 0.4F + 1.1329F * 0.5F - 0.0083F * 0.2F,
                   -0.0182F * 0.4F - 0.1006F * 0.5F + 1.1187F * 0.2F);
    const Rgb expected[] = {wide, wide, Rgb(0.4F, 0.5F, 0.2F), Rgb(2), Rgb(0.4F, 0.5F, 0.2F)};
    for (std::size_t i = 0; i < 5; ++i)
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(colours[i][c], expected[i][c], 2e-4F) << i << ' ' << c;
    EXPECT_THAT(warnings, Not(Contains(HasSubstr("gamut"))));

    const auto [green, said] = lights("ColorSpace \"rec2020\" LightSource \"point\" \"rgb I\" [ 0 1 0 ]\n");
    EXPECT_THAT(said, Contains(HasSubstr("\"I\": this rec2020 colour is outside the gamut of sRGB")));
    EXPECT_EQ(green[0].x, 0);
    EXPECT_NEAR(luminance(green[0]), 0.678, 1e-3);
}

struct ImageFolder {
    TemporaryFolder folder;
    // Writes an image with a red upper left pixel that is black elsewhere.
    void write(const std::string& name, int width, int height) const {
        Image image = Image::rgb(width, height);
        image.set_rgb(0, 0, Rgb(2, 0, 0));
        write_exr(folder / name, image);
    }
    Assembled assembled(const std::string& world, RecordingMonitor& monitor, bool skip_missing = false,
                        bool strict = false) const {
        SceneOverrides overrides;
        overrides.strict = strict;
        overrides.skip_missing = skip_missing;
        Draft draft = read_draft(std::string(kHead) + world, folder / "scene.pbrt", overrides, monitor);
        return assemble(std::move(draft), {1}, monitor);
    }
    std::unique_ptr<Light> light(const std::string& world) const {
        RecordingMonitor monitor;
        return std::move(assembled(world, monitor).parts.lights.at(0));
    }
    std::string refusal(const std::string& world) const {
        RecordingMonitor monitor;
        return error_of([&] { assembled(world, monitor, false, true); });
    }
};

Rgb sky(const Light& light, const V3f& w) {
    return light.Le({V3f(0.0F), w.normalized()}).value().radiance;
}

TEST(ImageLights, InfiniteMapname_IsByLatitudeAndLongitude) {
    const ImageFolder images;
    images.write("sky.exr", 8, 4);
    const auto light = images.light(
        "LightSource \"infinite\" \"string mapname\" \"sky.exr\" \"rgb L\" [3 1 1] \"float scale\" 2");
    EXPECT_EQ(sky(*light, {0.1F, 0.05F, 1}), Rgb(12, 0, 0)) << "upper left: near +z, a little beyond +x";
    EXPECT_EQ(sky(*light, {0.1F, -0.05F, 1}), Rgb(0.0F));
    EXPECT_EQ(sky(*light, {0.1F, 0.05F, -1}), Rgb(0.0F));
    // The sky is rotated and mirrored with the scene.
    const auto turned =
        images.light("Rotate -90 1 0 0 LightSource \"infinite\" \"string mapname\" \"sky.exr\"");
    EXPECT_EQ(sky(*turned, {0.1F, 1, -0.05F}), Rgb(2, 0, 0)) << "z became y, y became -z";
    const auto mirrored =
        images.light("Scale 1 -1 1 LightSource \"infinite\" \"string mapname\" \"sky.exr\"");
    EXPECT_EQ(sky(*mirrored, {0.1F, -0.05F, 1}), Rgb(2, 0, 0));
    EXPECT_THAT(images.refusal("Scale 1 2 1 LightSource \"infinite\" \"string mapname\" \"sky.exr\""),
                HasSubstr("stretched or sheared"));
}

TEST(ImageLights, InfiniteFilename_IsEqualArea) {
    const ImageFolder images;
    images.write("square.exr", 8, 8);
    images.write("wide.exr", 8, 4);
    images.write("odd.exr", 7, 4);
    const auto light = images.light("LightSource \"infinite\" \"string filename\" \"square.exr\"");
    EXPECT_EQ(sky(*light, {-0.1F, -0.1F, -1}), Rgb(2, 0, 0)) << "the corners are -z; left is -x, top is -y";
    EXPECT_EQ(sky(*light, {0.1F, -0.1F, -1}), Rgb(0.0F));
    RecordingMonitor monitor;
    images.assembled("LightSource \"infinite\" \"string filename\" \"wide.exr\"", monitor);
    EXPECT_THAT(monitor.warnings.at(0), HasSubstr("8 × 4 is not square: read as latitude-longitude"));
    EXPECT_THAT(images.refusal("LightSource \"infinite\" \"string filename\" \"odd.exr\""),
                HasSubstr("the image is 7 × 4; expected a square"));
}

TEST(ImageLights, Illuminance_IsWhatAPlaneThatFacesZReceives) {
    const ImageFolder images;
    Image image = Image::rgb(64, 64);
    std::fill(image.data.begin(), image.data.end(), 3.0F);
    write_exr(images.folder / "grey.exr", image);
    const auto light =
        images.light("LightSource \"infinite\" \"string filename\" \"grey.exr\" \"float illuminance\" 100");
    EXPECT_NEAR(luminance(sky(*light, {1, 2, 3})), 100 / M_PI, 0.05) << "by texel centres";
}

TEST(ImageLights, Goniometric_HasItsPoleAtY) {
    const ImageFolder images;
    images.write("lamp.exr", 8, 4);
    images.write("square.exr", 8, 8);
    const auto towards = [](const Light& light, const V3f& x) {
        const auto light_sample = light.sample_Li(x, {0.5F, 0.5F});
        return light_sample ? light_sample->weight.x : 0.0F;
    };
    for (const std::string name : {"goniometric", "goniophotometric"}) {
        const auto light =
            images.light("LightSource \"" + name + "\" \"string mapname\" \"lamp.exr\" \"rgb I\" [3 1 1]");
        EXPECT_FLOAT_EQ(towards(*light, V3f(0.1F, 1, 0.05F) * 2.0F), 6 / (4 * 1.0125F));
        EXPECT_EQ(towards(*light, {0.1F, 1, -0.05F}), 0);
        EXPECT_EQ(towards(*light, {0.1F, 0.05F, 1}), 0);
    }
    const auto light =
        images.light("LightSource \"goniometric\" \"string filename\" \"square.exr\" \"float power\" 5");
    EXPECT_GT(towards(*light, {-0.1F, -1, -0.1F}), 0);
    EXPECT_EQ(towards(*light, {0.1F, -1, 0.1F}), 0);
    EXPECT_NEAR(light->power(), 5, 1e-4);
}

TEST(ImageLights, Projection_IsUprightInVersion4Only) {
    const ImageFolder images;
    images.write("slide.exr", 4, 2);
    const auto lit = [](const Light& light, const V3f& x) { return light.sample_Li(x, {}).has_value(); };
    const auto v4 = images.light(
        "Translate 0 0 1 LightSource \"projection\" \"string filename\" \"slide.exr\" \"float power\" 7");
    // The field of view is 90 degrees across the shorter side: at distance 1, x in (-2, 2), y in (-1, 1).
    const V3f origin(0, 0, 0);  // the scene's origin, which lies at its only light
    EXPECT_TRUE(lit(*v4, origin + V3f(-1.5F, 0.5F, 1)));
    EXPECT_FALSE(lit(*v4, origin + V3f(-1.5F, -0.5F, 1)));
    EXPECT_FALSE(lit(*v4, origin + V3f(-0.5F, 0.5F, 1)));
    EXPECT_FALSE(lit(*v4, origin + V3f(-1.5F, 0.5F, -1)));
    EXPECT_FALSE(lit(*v4, origin + V3f(-2.1F, 0.5F, 1)));
    EXPECT_NEAR(v4->power(), 7, 1e-4);
    const auto v3 =
        images.light("LightSource \"projection\" \"string mapname\" \"slide.exr\" \"float fov\" 90");
    EXPECT_TRUE(lit(*v3, {-1.5F, -0.5F, 1}));
    EXPECT_FALSE(lit(*v3, {-1.5F, 0.5F, 1}));
}

TEST(ImageLights, MissingImage_IsRefusedOrGrey) {
    const ImageFolder images;
    const std::string world = "LightSource \"infinite\" \"string mapname\" \"no.exr\" \"rgb L\" [2 2 2]";
    EXPECT_THAT(images.refusal(world), HasSubstr("no such file"));
    RecordingMonitor monitor;
    const Assembled scene = images.assembled(world, monitor, true);
    EXPECT_THAT(monitor.warnings.at(0), HasSubstr("the file is missing; grey is used"));
    EXPECT_EQ(sky(*scene.parts.lights.at(0), {1, 2, 3}), Rgb(1.0F));
}

TEST(Lights, BadColours_AreRefused) {
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"rgb I\" [1 -2 3]"),
                HasSubstr("scene.pbrt:2:32: \"I\": -2 is not accepted"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"rgb I\" [1 1e39 3]"),
                HasSubstr("1e+39 is not accepted"));
    EXPECT_THAT(
        refusal_of_world("LightSource \"point\" \"blackbody I\" [3000 1 2]"),
        HasSubstr("\"I\" has 3 numbers; expected a temperature in kelvins, or a temperature and a scale"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"blackbody I\" 0"),
                HasSubstr("\"I\": 0 is not accepted; expected 300 to 1e+06"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" [400 1 700]"),
                HasSubstr("\"I\" has 3 numbers; expected pairs"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" [400 1 300 1]"),
                HasSubstr("scene.pbrt:2:41: wavelength 300 follows 400"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" [400 -1 500 1]"),
                HasSubstr("scene.pbrt:2:39: \"I\": -1 is not accepted"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" \"stdilum-D65\""),
                HasSubstr("did you mean \"stdillum-D65\"?"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"spectrum I\" \"no.spd\""),
                HasSubstr("scene.pbrt:2:21: no.spd: no such file"));
    EXPECT_THAT(refusal_of_world("LightSource \"projection\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world("LightSource \"goniometrik\""), HasSubstr("did you mean \"goniometric\"?"));
}

}  // namespace lights_test
}  // namespace lucerna
