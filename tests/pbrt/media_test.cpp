// Participating media in scene files: how they are built and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scene_text.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace media_test {

using namespace lucerna::testing;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const Medium& medium_of(const Draft& draft, std::size_t index) {
    return draft.media.at(index).medium.value();
}

TEST(NamedMedium, Homogeneous_ScalesBothCoefficientsAndEmitsWhatItAbsorbs) {
    const Read read = read_world(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [4 "
        "5 6]"
        " \"float scale\" 0.5 \"float g\" -0.25 \"rgb Le\" [1 0 2] \"float Lescale\" 3");
    EXPECT_THAT(read.warnings, ::testing::Each(::testing::Not(HasSubstr("MakeNamedMedium"))));
    const Medium& fog = medium_of(read.draft, 0);
    EXPECT_EQ(fog.sigma_a, Rgb(0.5F, 1, 1.5F));
    EXPECT_EQ(fog.sigma_s, Rgb(2, 2.5F, 3));
    EXPECT_EQ(fog.g, -0.25F);
    EXPECT_EQ(fog.emission, Rgb(1.5F, 0, 9));
    EXPECT_FALSE(fog.box);
    EXPECT_FALSE(read.draft.uses_media);  // no shape contains it
}

TEST(NamedMedium, Unsaid_IsWholeMilkAndGridsOfVersion4AreOnes) {
    const Read read = read_world(
        "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" MakeNamedMedium \"b\" \"string type\" "
        "\"uniformgrid\" \"float density\" 1 MakeNamedMedium \"c\" \"string type\" \"heterogeneous\" \"float "
        "density\" 1");
    EXPECT_EQ(medium_of(read.draft, 0).sigma_s, Rgb(2.55F, 3.21F, 3.77F));
    EXPECT_EQ(medium_of(read.draft, 0).sigma_a, Rgb(0.0011F, 0.0024F, 0.014F));
    EXPECT_EQ(medium_of(read.draft, 1).sigma_s, Rgb(1));
    EXPECT_EQ(medium_of(read.draft, 1).sigma_a, Rgb(1));
    EXPECT_EQ(medium_of(read.draft, 2).sigma_s, Rgb(2.55F, 3.21F, 3.77F));
}

TEST(NamedMedium, Preset_IsTheMeasuredOneAndAnotherIsRefusedWithItsNeighbour) {
    const Read read = read_world(
        "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"string preset\" \"Skin1\" \"float scale\" "
        "10");
    EXPECT_EQ(medium_of(read.draft, 0).sigma_s, Rgb(0.74F, 0.88F, 1.01F) * 10.0F);
    EXPECT_EQ(medium_of(read.draft, 0).sigma_a, Rgb(0.032F, 0.17F, 0.48F) * 10.0F);
    EXPECT_THAT(
        refusal_of_world("MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"string preset\" \"Skim1\""),
        AllOf(HasSubstr("scene.pbrt:2:"), HasSubstr("did you mean \"Skin1\""), HasSubstr("Wholemilk")));
}

// The presets that are measured by dilution have names of several words, in pbrt's spelling.
TEST(NamedMedium, PresetsOfBothPapers_AreFoundByPbrtsNames) {
    const Read read = read_world(
        "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"string preset\" \"Lowfat Milk\" "
        "MakeNamedMedium \"b\" \"string type\" \"homogeneous\" \"string preset\" \"Head & Shoulders "
        "Shampoo\" "
        "MakeNamedMedium \"c\" \"string type\" \"homogeneous\" \"string preset\" \"Merlot\"");
    EXPECT_EQ(medium_of(read.draft, 0).sigma_s, Rgb(0.89187F, 1.5136F, 2.532F));
    EXPECT_EQ(medium_of(read.draft, 0).sigma_a, Rgb(0.002875F, 0.00575F, 0.0115F));
    EXPECT_EQ(medium_of(read.draft, 1).sigma_s, Rgb(0.023805F, 0.028804F, 0.034306F));
    EXPECT_EQ(medium_of(read.draft, 1).sigma_a, Rgb(0.084621F, 0.15688F, 0.20365F));
    EXPECT_EQ(medium_of(read.draft, 2).sigma_s, Rgb(2.1129e-05F, 0, 0));
    // A misspelt name is answered with the list of all presets.
    const std::string refusal = refusal_of_world(
        "MakeNamedMedium \"a\" \"string type\" \"homogeneous\" \"string preset\" \"Regular Soymilk\"");
    EXPECT_THAT(refusal, AllOf(HasSubstr("did you mean \"Regular Soy Milk\""), HasSubstr("Apple, Chicken1"),
                               HasSubstr("Suisse Mocha Powder, Pacific Ocean Surface Water")));
    EXPECT_EQ(std::count(refusal.begin(), refusal.end(), ','), 46);
}

TEST(NamedMedium, Grid_StandsInItsBoxUnderTheTransformation) {
    const Read read = read_world(
        "Translate 1 2 3 MakeNamedMedium \"g\" \"string type\" \"uniformgrid\" \"integer nx\" 2 \"integer "
        "ny\" 1 "
        "\"integer nz\" 2 \"float density\" [1 2 3 4] \"point3 p0\" [0 0 0] \"point3 p1\" [2 1 2]");
    const Medium& medium = medium_of(read.draft, 0);
    EXPECT_EQ(read.draft.media[0].world_from_medium[3][1], 2);
    EXPECT_DOUBLE_EQ(density_at(medium.density, {0.5, 0.5, 0.5}), 1);
    EXPECT_DOUBLE_EQ(density_at(medium.density, {1.5, 0.5, 1.5}), 4);
    EXPECT_DOUBLE_EQ(density_at(medium.density, {1.5, 1, 1.5}), 2);  // falls to 0 across the boundary
}

TEST(NamedMedium, WhatIsNone_IsRefusedInOneLine) {
    const auto refusal = [](std::string_view rest) {
        return refusal_of_world("MakeNamedMedium \"m\" " + std::string(rest));
    };
    EXPECT_THAT(refusal(""), HasSubstr("lacks \"string type\""));
    EXPECT_THAT(refusal("\"string type\" \"cloud\""), HasSubstr("\"cloud\" is not supported"));
    EXPECT_THAT(refusal("\"string type\" \"nanovdb\""), HasSubstr("not supported yet"));
    EXPECT_THAT(refusal("\"string type\" \"rgbgrid\""), HasSubstr("is empty"));
    EXPECT_THAT(refusal("\"string type\" \"rgbgrid\" \"rgb sigma_s\" [1 2 3]"),
                HasSubstr("\"rgbgrid\" is not supported"));
    EXPECT_THAT(refusal("\"string type\" \"homogenous\""), HasSubstr("did you mean \"homogeneous\""));
    const std::string fog = "\"string type\" \"homogeneous\" ";
    EXPECT_THAT(refusal(fog + "\"float g\" 1"), HasSubstr("g of MakeNamedMedium"));
    EXPECT_THAT(refusal(fog + "\"float scale\" -1"), HasSubstr("scale of MakeNamedMedium"));
    EXPECT_THAT(refusal(fog + "\"rgb sigma_a\" [1 -1 1]"), HasSubstr("sigma_a"));
    EXPECT_THAT(refusal(fog + "\"rgb sigma_s\" [1e30 1 1]"), HasSubstr("1e+30"));
    const std::string grid = "\"string type\" \"uniformgrid\" ";
    EXPECT_THAT(refusal(grid), HasSubstr("float density"));
    EXPECT_THAT(refusal(grid + "\"integer nx\" 3 \"float density\" [1 2]"), HasSubstr("has 2 values"));
    EXPECT_THAT(refusal(grid + "\"integer nx\" 0 \"float density\" [1 2]"), HasSubstr("\"nx\": 0"));
    EXPECT_THAT(refusal(grid + "\"integer nx\" 2 \"float density\" [1 -2]"), HasSubstr("-2 is not accepted"));
    EXPECT_THAT(refusal(grid + "\"float density\" 1 \"point3 p1\" [0 1 1]"), HasSubstr("do not span a box"));
    EXPECT_THAT(refusal(grid + "\"float density\" 1 \"float temperature\" 1"),
                HasSubstr("\"temperature\" is not supported"));
}

// --- MediumInterface

TEST(MediumInterface, OnAShape_IsAnInterfaceOnlyWhereTheSidesDiffer) {
    const Read read = read_world(
        "MediumInterface \"in\" \"\" MakeNamedMedium \"in\" \"string type\" \"homogeneous\"\n"
        "Shape \"sphere\" MediumInterface \"in\" Shape \"sphere\" AttributeBegin MediumInterface \"\" \"in\" "
        "Shape \"sphere\" AttributeEnd");
    const auto& q = read.draft.quadrics;
    EXPECT_TRUE(q[0].traits.media.is_interface);
    EXPECT_EQ(q[0].traits.media.inside, 0);
    EXPECT_EQ(q[0].traits.media.outside, kNoMedium);
    EXPECT_FALSE(q[1].traits.media.is_interface);
    EXPECT_TRUE(q[2].traits.media.is_interface);
    EXPECT_EQ(q[2].traits.media.outside, 0);
    EXPECT_TRUE(read.draft.uses_media);
    EXPECT_EQ(read.draft.camera_medium, kNoMedium);
}

TEST(MediumInterface, BeforeTheCamera_IsWhatTheCameraIsIn) {
    const Read read = read_file_text(
        "MakeNamedMedium \"air\" \"string type\" \"homogeneous\"\nMediumInterface \"\" \"air\"\n"
        "Camera \"perspective\" Film \"rgb\" WorldBegin");
    EXPECT_EQ(read.draft.camera_medium, 0);
    EXPECT_TRUE(read.draft.uses_media);
}

TEST(MediumInterface, OfAMediumThatIsNeverMade_IsRefusedWhereItIsNamed) {
    EXPECT_THAT(refusal_of_world("MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nMediumInterface "
                                 "\"fob\" \"\""),
                AllOf(HasSubstr("scene.pbrt:3:"), HasSubstr("\"fob\""), HasSubstr("did you mean \"fog\"")));
}

TEST(MediumInterface, InTheScene_ChangesTheMediumAtAnInterface) {
    RecordingMonitor monitor;
    const Job job =
        read_scene_text(std::string(kHead) +
                            "MakeNamedMedium \"in\" \"string type\" \"homogeneous\" MediumInterface "
                            "\"in\" \"\" Material \"interface\" Translate 0 0 5 Shape \"sphere\"",
                        "scene.pbrt", {}, {1}, monitor);
    const Ray ray{V3f(V3d(0, 0, 0) - job.scene.origin()), {0, 0, 1}};
    EXPECT_FALSE(job.scene.intersect(ray));
    ASSERT_TRUE(job.scene.intersect_medium_interface(ray));
    const auto found = job.scene.intersect_with_medium_interfaces(ray);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->t, 4, 1e-5);
    EXPECT_TRUE(job.scene.is_medium_interface(*found));
    EXPECT_EQ(medium_towards(found->media, found->at.n, ray.d, kNoMedium), 0);
    EXPECT_TRUE(job.scene.unoccluded({ray.o}, ray.d, 100));
}

// --- versions 1 and 2

TEST(Volume, EveryKind_IsARegionUnderTheTransformation) {
    const Read read = read_world(
        "Translate 5 0 0 Volume \"homogeneous\" \"color sigma_a\" [1 2 3] \"point p0\" [1 1 1] \"point p1\" "
        "[-1 -1 "
        "-1] \"color Le\" [2 2 2] \"float g\" 0.5\n"
        "Volume \"volumegrid\" \"integer nx\" 2 \"float density\" [1 3] \"color sigma_s\" [1 1 1]\n"
        "Volume \"exponential\" \"float a\" 2 \"float b\" 3 \"vector updir\" [0 0 2] \"color sigma_s\" [1 1 "
        "1]");
    const Draft& draft = read.draft;
    ASSERT_EQ(draft.regions.size(), 3U);
    EXPECT_TRUE(draft.uses_media);
    const Medium& box = medium_of(draft, 0);
    EXPECT_EQ(box.sigma_a, Rgb(1, 2, 3));
    EXPECT_EQ(box.sigma_s, Rgb(0));
    EXPECT_EQ(box.emission, Rgb(2));  // emission as given
    EXPECT_EQ(box.box->min, V3d(-1));
    EXPECT_EQ(draft.media[0].world_from_medium[3][0], 5);
    EXPECT_DOUBLE_EQ(density_at(medium_of(draft, 1).density, {1, 0.5, 0.5}), 3);  // clamped at the face
    EXPECT_DOUBLE_EQ(density_at(medium_of(draft, 2).density, {0, 0, 0.5}), 2 * std::exp(-1.5));
}

TEST(Volume, OfNothing_IsLeftOutWithAWarningAndAnUnknownOneRefused) {
    const Read read = read_world("Volume \"homogeneous\"");
    EXPECT_FALSE(read.draft.uses_media);
    EXPECT_THAT(read.warnings, ::testing::Contains(HasSubstr("has no effect")));
    EXPECT_THAT(refusal_of_world("Volume \"homogenous\""), HasSubstr("did you mean \"homogeneous\""));
    EXPECT_THAT(refusal_of_world("Volume \"exponential\" \"float b\" -1e9"),
                HasSubstr("the density reaches"));
    EXPECT_THAT(refusal_of_world("Volume \"exponential\" \"vector updir\" [0 0 0]"), HasSubstr("no length"));
}

TEST(VolumeIntegrator, SingleAndEmission_AreTakenWithANote) {
    for (const std::string kind : {"single", "emission"}) {
        const Read read =
            read_file_text("VolumeIntegrator \"" + kind +
                           "\" \"float stepsize\" 0.5 Camera \"perspective\" Film \"image\" WorldBegin");
        EXPECT_THAT(read.infos, ::testing::Contains(HasSubstr("all orders of scattering")));
        EXPECT_THAT(read.warnings, ::testing::Each(::testing::Not(HasSubstr("VolumeIntegrator"))));
    }
    EXPECT_THAT(refusal_of_file("VolumeIntegrator \"double\" Camera \"perspective\" WorldBegin"),
                HasSubstr("single"));
}

TEST(Media, ThatGlow_ArePathTracedWithOneWarningAndOthersAreNot) {
    const std::string fog = " Volume \"homogeneous\" \"color sigma_s\" [1 1 1]";
    const std::string fire = fog + " \"color Le\" [1 0.5 0]";
    for (const std::string kind : {"directlighting", "photonmap", "igi"}) {
        const std::string head =
            "SurfaceIntegrator \"" + kind + "\" Camera \"perspective\" Film \"image\" WorldBegin";
        const auto about = [](const std::string& line) { return line.find("emits light") != line.npos; };
        const Read with = read_file_text(head + fire + fire);
        EXPECT_TRUE(std::holds_alternative<PathSettings>(with.draft.integrator)) << kind;
        EXPECT_EQ(std::ranges::count_if(with.warnings, about), 1);
        const Read without = read_file_text(head + fog);
        EXPECT_FALSE(std::holds_alternative<PathSettings>(without.draft.integrator)) << kind;
        EXPECT_EQ(std::ranges::count_if(without.warnings, about), 0);
    }
}

TEST(Media, OldScenes_AreReadAsTheyStand) {
    LUCERNA_NEED_DATA(folder, "pbrt");
    for (const char* const name : {"pbrt-v1/spotfog.pbrt", "pbrt-v2/smoke-2.pbrt"}) {
        RecordingMonitor monitor;
        const Job job = read_scene(folder / name, {}, {1}, monitor);
        EXPECT_EQ(job.scene.media().regions.size(), 1U) << name;
        EXPECT_TRUE(std::holds_alternative<PathSettings>(job.integrator));
        EXPECT_THAT(monitor.warnings, IsEmpty());
    }
}

}  // namespace media_test
}  // namespace lucerna
