// Directives: order, nesting, inclusion and parameters. Every refusal is one line with a place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <regex>

#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace directives_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

void write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream(file, std::ios::binary) << text;
}

std::string refusal_of(const std::filesystem::path& file) {
    Monitor monitor;
    try {
        read_scene(file, {}, {1}, monitor);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Directives, VersionThreeAndFour_AreBothRead) {
    EXPECT_EQ(refusal_of_file(
                  "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" 39\n"
                  "Film \"image\" \"integer xresolution\" [8]\nSampler \"halton\"\nIntegrator \"path\"\n"
                  "WorldBegin\nMaterial \"matte\" \"color Kd\" [.5 .5 .8]\nShape \"sphere\"\nWorldEnd\n"),
              "");
    EXPECT_EQ(refusal_of_file(
                  "LookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" [ 39 ]\n"
                  "Film \"rgb\" \"integer xresolution\" 8\nSampler \"zsobol\"\nIntegrator \"path\"\n"
                  "ColorSpace \"srgb\"\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [.5 .5 .8]\n"
                  "AttributeBegin\nReverseOrientation\nShape \"sphere\"\nAttributeEnd\n"),
              "");
}

TEST(Directives, OutOfOrder_AreRefused) {
    EXPECT_EQ(refusal_of_file("Shape \"sphere\""),
              "scene.pbrt:1:1: Shape is before WorldBegin; put it after it");
    EXPECT_THAT(refusal_of_world("Camera \"perspective\""), HasSubstr("Camera is after WorldBegin"));
    EXPECT_THAT(refusal_of_world("WorldBegin"), HasSubstr("WorldBegin is after WorldBegin"));
    EXPECT_THAT(refusal_of_world("WorldEnd\nShape \"sphere\""),
                HasSubstr("scene.pbrt:3:1: the text after WorldEnd is another frame"));
    EXPECT_EQ(refusal_of_file("Camera \"perspective\"\n"),
              "scene.pbrt:2:1: the file ends without WorldBegin");
    EXPECT_EQ(refusal_of_file(""), "scene.pbrt:1:1: the file ends without WorldBegin");
}

TEST(Directives, Movement_StandsStillAtItsStart) {
    const Read read = read_world(
        "TransformTimes 0 1 ActiveTransform EndTime Translate 9 9 9 ActiveTransform StartTime Translate 1 2 "
        "3\n"
        "ActiveTransform All Shape \"sphere\"");
    const M44d& m = read.draft.quadrics.front().world_from_object;
    EXPECT_EQ(V3d(m[3][0], m[3][1], m[3][2]), V3d(1, 2, 3));
    EXPECT_THAT(read.warnings, ::testing::Contains(HasSubstr("motion is not supported")));
    EXPECT_THAT(refusal_of_world("ActiveTransform Sometime"), HasSubstr("StartTime, EndTime or All"));
}

TEST(Directives, Objects_AreKeptApartAndPlacedByTheirInstances) {
    const Read read = read_world(
        "Translate 1 0 0 ObjectBegin \"a\" Translate 0 1 0 Shape \"sphere\" ObjectEnd\n"
        "ObjectBegin \"b\" Shape \"disk\" ObjectInstance \"a\" ObjectEnd\n"
        "ObjectInstance \"a\" Scale 2 2 2 ObjectInstance \"b\" Shape \"sphere\"");
    ASSERT_EQ(read.draft.objects.size(), 2U);
    EXPECT_EQ(read.draft.quadrics.size(), 1U);
    EXPECT_EQ(read.draft.objects[0]->shapes.quadrics.size(), 1U);
    EXPECT_EQ(read.draft.objects[1]->instances.size(), 1U);
    ASSERT_EQ(read.draft.instances.size(), 2U);
    EXPECT_EQ(read.draft.instances[0].world_from_world.translation(), V3d(1, 0, 0));
    const SceneParts parts = parts_of_world(
        "ObjectBegin \"a\" Translate 0 1 0 Shape \"sphere\" ObjectEnd "
        "ObjectBegin \"b\" Translate 5 0 0 ObjectInstance \"a\" ObjectEnd "
        "Shape \"sphere\" Translate 0 0 3 ObjectInstance \"b\" ObjectInstance \"a\"");
    ASSERT_EQ(parts.instances.size(), 2U);
    ASSERT_EQ(parts.prototypes.size(), 1U) << "b has no shapes of its own";
    EXPECT_NEAR(
        (parts.instances[0].world_from_prototype.translation() + parts.origin - V3d(5, 1, 3)).length(), 0,
        1e-12);
    EXPECT_NEAR(
        (parts.instances[1].world_from_prototype.translation() + parts.origin - V3d(0, 1, 3)).length(), 0,
        1e-12);
}

TEST(Directives, ObjectsLeftOpen_AreEachCompleteOnce) {
    const Read read =
        read_world("ObjectBegin \"a\" Shape \"sphere\" ObjectBegin \"b\" Shape \"disk\" Shape \"disk\"");
    ASSERT_EQ(read.draft.objects.size(), 2U);
    EXPECT_EQ(read.draft.objects[0]->shapes.quadrics.size(), 1U);
    EXPECT_EQ(read.draft.objects[1]->shapes.quadrics.size(), 2U);
}

TEST(Directives, BadObjects_AreRefused) {
    EXPECT_THAT(refusal_of_world("ObjectInstance \"bax\""), HasSubstr("there is no object \"bax\""));
    EXPECT_THAT(refusal_of_world("ObjectBegin \"box\" ObjectInstance \"box\" ObjectEnd"),
                HasSubstr("there is no object \"box\""));
    EXPECT_THAT(refusal_of_world("ObjectBegin \"box\" ObjectEnd ObjectInstance \"bix\""),
                HasSubstr("did you mean \"box\"?"));
    EXPECT_THAT(refusal_of_world("ObjectEnd"), HasSubstr("ObjectEnd without ObjectBegin"));
    EXPECT_THAT(refusal_of_world("ObjectBegin \"a\" ObjectBegin \"b\""),
                HasSubstr("ObjectBegin within the ObjectBegin of \"a\""));
    EXPECT_THAT(refusal_of_world("ObjectBegin \"a\" AttributeEnd"),
                HasSubstr("AttributeEnd without AttributeBegin"));
    EXPECT_THAT(refusal_of_world("AttributeBegin ObjectBegin \"a\" AttributeEnd"),
                HasSubstr("blocks must nest"));
    EXPECT_THAT(
        read_world("AreaLightSource \"diffuse\" ObjectBegin \"a\" Shape \"sphere\" ObjectEnd").warnings.at(0),
        HasSubstr("is part of an object that is shown by instances: it emits nothing"));
}

TEST(Directives, UnknownAndUnsupportedNames_AreTold) {
    EXPECT_EQ(
        refusal_of_world("Shap \"sphere\""),
        "scene.pbrt:2:1: unknown directive \"Shap\"; did you mean \"Shape\"? expected a directive of pbrt");
    EXPECT_THAT(refusal_of_world("MediumInterface \"fog\" \"\""), HasSubstr("there is no medium \"fog\""));
    EXPECT_EQ(refusal_of_world("MediumInterface \"\" \"\""), "");
    EXPECT_THAT(refusal_of_world("\"sphere\""), HasSubstr("a directive is expected here, not \"sphere\""));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" 1 2"),
                HasSubstr("scene.pbrt:2:33: a directive is expected here, not \"2\"; put several values"));
    EXPECT_THAT(refusal_of_world("]"), HasSubstr("not \"]\""));
    EXPECT_THAT(refusal_of_world("Shape sphere"),
                HasSubstr("Shape expects a kind of shape in quotes here, not \"sphere\""));
}

TEST(Directives, Blocks_RestoreWhatTheyChanged) {
    const Read read = read_world(
        "AttributeBegin Translate 1 0 0 ReverseOrientation Material \"mirror\" AreaLightSource \"diffuse\" "
        "Shape \"sphere\" AttributeEnd Shape \"sphere\" "
        "TransformBegin Translate 0 7 0 Material \"glass\" TransformEnd Shape \"sphere\"");
    const auto& q = read.draft.quadrics;
    ASSERT_EQ(q.size(), 3U);
    EXPECT_EQ(q[0].world_from_object.translation(), V3d(1, 0, 0));
    EXPECT_TRUE(q[0].traits.reverse_orientation);
    EXPECT_EQ(q[0].traits.light, 0);
    EXPECT_EQ(q[1].world_from_object, M44d());
    EXPECT_FALSE(q[1].traits.reverse_orientation);
    EXPECT_EQ(q[1].traits.light, kNoLight);
    EXPECT_EQ(read.draft.materials[q[1].traits.material].name, "default");
    EXPECT_EQ(q[2].world_from_object, M44d()) << "TransformEnd restores the transformation";
    EXPECT_EQ(read.draft.materials[q[2].traits.material].name, "glass") << "and nothing else";
}

TEST(Directives, Blocks_MustNest) {
    EXPECT_EQ(refusal_of_world("AttributeEnd"), "scene.pbrt:2:1: AttributeEnd without AttributeBegin");
    EXPECT_EQ(refusal_of_world("AttributeBegin"),
              "scene.pbrt:2:1: this AttributeBegin is not ended before the end of the file");
    EXPECT_THAT(refusal_of_world("AttributeBegin\nTransformBegin\nAttributeEnd"),
                HasSubstr("scene.pbrt:4:1: AttributeEnd closes the TransformBegin of scene.pbrt:3:1"));
    EXPECT_THAT(refusal_of_world("AttributeBegin WorldEnd"), HasSubstr("is not ended before WorldEnd"));
}

TEST(Directives, DeepNesting_IsNoDanger) {
    std::string text;
    for (int i = 0; i < 100'000; ++i) text += "AttributeBegin ";
    for (int i = 0; i < 100'000; ++i) text += "AttributeEnd ";
    EXPECT_EQ(refusal_of_world(text), "");
}

TEST(Directives, Attribute_GivesDefaultsWithinItsBlock) {
    const Read read = read_world(
        "AttributeBegin Attribute \"shape\" \"float radius\" 3 Attribute \"material\" \"rgb reflectance\" [1 "
        "0 0] "
        "Shape \"sphere\" Shape \"sphere\" \"float radius\" 4 Material \"diffuse\" Shape \"disk\" "
        "AttributeEnd "
        "Shape \"sphere\"");
    EXPECT_EQ(read.draft.quadrics[0].radius, 3);
    EXPECT_EQ(read.draft.quadrics[1].radius, 4) << "what the shape says itself holds";
    EXPECT_EQ(read.draft.quadrics[3].radius, 1);
    EXPECT_EQ(std::get<DiffuseMaterial>(read.draft.materials[1].model).reflectance.at(V2f(0, 0)),
              Rgb(1, 0, 0));
    EXPECT_TRUE(read.warnings.empty());
    EXPECT_THAT(refusal_of_world("Attribute \"camera\""), HasSubstr("Attribute \"camera\" is unknown"));
}

TEST(Directives, Include_IsReadInPlaceAndFromTheMainFilesFolder) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "sub");
    write(folder / "main.pbrt",
          std::string(kHead) + "Translate 1 0 0 Include \"sub/a.pbrt\" Shape \"sphere\"");
    write(folder / "sub/a.pbrt", "Translate 0 1 0 Include \"b.pbrt\"");  // relative to main.pbrt, as in pbrt
    write(folder / "b.pbrt", "Translate 0 0 1");
    RecordingMonitor monitor;
    const auto text = std::string(kHead) + "Translate 1 0 0 Include \"sub/a.pbrt\" Shape \"sphere\"";
    const Draft draft = read_draft(text, folder / "main.pbrt", {}, monitor);
    EXPECT_EQ(draft.quadrics.at(0).world_from_object.translation(), V3d(1, 1, 1));
}

TEST(Directives, Import_KeepsItsChangesToItself) {
    const TemporaryFolder folder;
    write(folder / "a.pbrt", "Translate 5 5 5 ReverseOrientation Shape \"sphere\"");
    Monitor monitor;
    const Draft draft =
        read_draft(std::string(kHead) + "Import \"a.pbrt\" Shape \"sphere\"", folder / "m.pbrt", {}, monitor);
    EXPECT_EQ(draft.quadrics.at(0).world_from_object.translation(), V3d(5, 5, 5));
    EXPECT_EQ(draft.quadrics.at(1).world_from_object, M44d());
    EXPECT_FALSE(draft.quadrics.at(1).traits.reverse_orientation);
}

TEST(Directives, BadIncludes_AreRefusedAtTheDirective) {
    const TemporaryFolder folder;
    const auto main = folder / "main.pbrt";
    const auto refused = [&](const std::string& include) {
        write(main, std::string(kHead) + include);
        return refusal_of(main);
    };
    EXPECT_EQ(refused("Include \"no.pbrt\""), main.string() + ":2:1: Include \"no.pbrt\": " +
                                                  (folder / "no.pbrt").string() + ": no such file");
    EXPECT_THAT(refused("Include \"main.pbrt\""),
                HasSubstr(":2:1: Include \"main.pbrt\": the file includes itself"));
    std::filesystem::create_directory(folder / "sub");
    EXPECT_THAT(refused("Include \"sub\""), HasSubstr("is a folder, not a file"));
    write(folder / "cut.pbrt.gz", "\x1f\x8b\x08");
    EXPECT_THAT(refused("Include \"cut.pbrt.gz\""), HasSubstr("its compressed data end too early"));
    EXPECT_THAT(refused("Include \"/dev/zero\""), HasSubstr("expected a regular file"));
    write(folder / "bad.pbrt", "\n  Shap");
    EXPECT_THAT(refused("Include \"bad.pbrt\""), HasSubstr("bad.pbrt:2:3: unknown directive"));
    // The depth limit stops a file that includes itself under ever longer names.
    write(folder / "deep.pbrt", "Include \"./sub/../deep.pbrt\"");
    for (int i = 0; i < 70; ++i)
        write(folder / fmt::format("d{}.pbrt", i), fmt::format("Include \"d{}.pbrt\"", i + 1));
    EXPECT_THAT(refused("Include \"d0.pbrt\""), HasSubstr("nested more than 64 deep"));
}

TEST(Directives, UnfitFiles_AreRefusedByName) {
    const TemporaryFolder folder;
    EXPECT_THAT(refusal_of(folder / "no.pbrt"), HasSubstr("no.pbrt: no such file"));
    EXPECT_THAT(refusal_of(folder.path()), HasSubstr("is a folder, not a file"));
    write(folder / "empty.pbrt", "");
    EXPECT_THAT(refusal_of(folder / "empty.pbrt"), HasSubstr("the file is empty"));
    EXPECT_THAT(refusal_of("/dev/zero"), HasSubstr("expected a regular file"));
}

TEST(Params, IllTyped_AreRefusedWithWhatIsAccepted) {
    EXPECT_EQ(refusal_of_world("Shape \"sphere\" \"integer radius\" 1"),
              "scene.pbrt:2:16: \"integer radius\" of Shape \"sphere\" has the wrong type; expected \"float "
              "radius\"");
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" [1 2]"),
                HasSubstr("has 2 values; expected 1"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" []"), HasSubstr("has 0 values"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" \"1\""),
                HasSubstr("\"1\" is not accepted; expected a number"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\""), HasSubstr("has no value"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" [1"),
                HasSubstr("this [ is never closed"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" Shape"),
                HasSubstr("\"Shape\" is not accepted"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"flaot radius\" 1"),
                HasSubstr("unknown type \"flaot\"; did you mean \"float\"?"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"radius\" 1"),
                HasSubstr("is not a parameter declaration"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float a b\" 1"),
                HasSubstr("is not a parameter declaration"));
    EXPECT_THAT(refusal_of_world("Shape \"sphere\" \"float radius\" 1 \"float radius\" 2"),
                HasSubstr("is given twice"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"point3 from\" [1 2]"),
                HasSubstr("has 2 numbers; expected a multiple of 3"));
    EXPECT_THAT(refusal_of_world("LightSource \"point\" \"rgb I\" [1 2 3 4 5 6]"),
                HasSubstr("has 6 numbers; expected 3"));
    EXPECT_THAT(refusal_of_world("AreaLightSource \"diffuse\" \"bool twosided\" 1"),
                HasSubstr("expected true or false"));
    EXPECT_THAT(
        refusal_of_file("Film \"rgb\" \"integer xresolution\" 1.5 WorldBegin"),
        HasSubstr("scene.pbrt:1:34: \"integer xresolution\": 1.5 is not accepted; expected a whole number"));
    EXPECT_THAT(refusal_of_file("Film \"rgb\" \"integer xresolution\" 3e9 WorldBegin"),
                HasSubstr("3000000000 is not"));
}

TEST(Params, SpellingsOfBlanksAndBrackets_AreAllTheSame) {
    for (const std::string text :
         {"\"float radius\" 2", "\"float radius\"[2]", "\"  float \t radius \" [ 2 ]",
          "\"float radius\" # note\n [ # note\n 2 ]"}) {
        EXPECT_EQ(read_world("Shape \"sphere\" " + text).draft.quadrics.at(0).radius, 2) << text;
    }
}

TEST(Params, Unused_AreWarnedOfWithPlaceAndNearestName) {
    const Read read = read_world("Shape \"sphere\" \"float raduis\" 2");
    ASSERT_EQ(read.warnings.size(), 1U);
    EXPECT_THAT(read.warnings[0],
                HasSubstr("scene.pbrt:2:16: \"float raduis\" of Shape \"sphere\" has no effect; did you "
                          "mean \"radius\"? known are"));
}

TEST(Params, EveryRefusal_IsOneLineWithAPlace) {
    const std::regex place("^scene\\.pbrt:[0-9]+:[0-9]+: [^\n]+$");
    for (const std::string bad :
         {"Shape", "Shape \"\"", "Shape \"a\\nb\"", "Material \"x\" \"float \\n y\" 1", "\"a\nb\"",
          "Translate a b c", "Include \"\"", "Include \"a\\nb\"",
          "Shape \"plymesh\" \"string filename\" \"a\\nb\"", "Texture \"a\" \"b\" \"c\"",
          "LightSource \"spot\" \"point3 from\" 1", "[[[", "1 2 3",
          "Shape \"trianglemesh\" \"point3 P\" [1 2 3 [", "NamedMaterial \"\"", "CoordSysTransform \"\"",
          "\x01\x02"}) {
        const std::string message = refusal_of_world(bad);
        EXPECT_TRUE(std::regex_match(message, place)) << bad << " -> " << message;
    }
}

}  // namespace directives_test
}  // namespace lucerna
