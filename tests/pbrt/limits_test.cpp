// The limits for scene text that nests or multiplies: text within them is read correctly, and text beyond
// them is refused at its place. tests/bombs runs the command on far worse text.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/system/files.h"
#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace limits_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Returns objects each of which instances the previous one `times` times; the first contains `first`, and the
// world instances the last.
std::string nested_objects(int depth, int times, std::string_view first = "Shape \"sphere\"") {
    std::string text = fmt::format("ObjectBegin \"o\" {} ObjectEnd\n", first);
    for (int i = 0; i < depth; ++i) {
        text += "ObjectBegin \"o\"";
        for (int k = 0; k < times; ++k) text += " Translate 1 0 0 ObjectInstance \"o\"";
        text += " ObjectEnd\n";
    }
    return text + "ObjectInstance \"o\"\n";
}

TEST(Limits, Objects64Deep_ArePlacedByAllThatHoldThem) {
    const SceneParts parts = parts_of_world(nested_objects(64, 1));
    ASSERT_EQ(parts.instances.size(), 1U);
    const V3d at = parts.instances[0].world_from_prototype.translation() + parts.origin;
    EXPECT_NEAR((at - V3d(64, 0, 0)).length(), 0, 1e-9);
    EXPECT_THAT(refusal_of_world(nested_objects(65, 1)),
                StartsWith("scene.pbrt:67:33: ObjectInstance \"o\": objects are nested more than 64 deep"));
}

TEST(Limits, Instances_AreCountedBeforeAnyIsMade) {
    EXPECT_EQ(parts_of_world(nested_objects(10, 2)).instances.size(), 1024U);
    EXPECT_THAT(refusal_of_world(nested_objects(27, 2)),
                HasSubstr("134217728 instances, counting nested ones; the limit is 100000000"));
    EXPECT_THAT(refusal_of_world(nested_objects(64, 3)), HasSubstr("18446744073709551615 instances"));
    EXPECT_TRUE(parts_of_world(nested_objects(64, 3, "")).instances.empty())
        << "what shows nothing is no work";
    std::string several = nested_objects(26, 2);  // 67,108,864 each
    EXPECT_EQ(refusal_of_world(several), "");
    several += "ObjectInstance \"o\"\n";
    EXPECT_THAT(refusal_of_world(several), HasSubstr("134217728 instances"));
}

// Returns textures each of which uses the previous one `times` times.
std::string nested_textures(std::string_view type, int depth, int times) {
    std::string text = fmt::format("Texture \"t\" \"{}\" \"checkerboard\"\n", type);
    for (int i = 0; i < depth; ++i) {
        text +=
            times == 1
                ? fmt::format("Texture \"t\" \"{}\" \"scale\" \"texture tex\" \"t\" \"float scale\" 0.5\n",
                              type)
                : fmt::format("Texture \"t\" \"{}\" \"mix\" \"texture tex1\" \"t\" \"texture tex2\" \"t\"\n",
                              type);
    }
    return text;
}

TEST(Limits, TexturesOf512Nodes_AreRead) {
    for (const char* type : {"spectrum", "float"}) {
        EXPECT_EQ(refusal_of_world(nested_textures(type, 511, 1)), "") << type;
        EXPECT_THAT(
            refusal_of_world(nested_textures(type, 512, 1)),
            StartsWith(
                "scene.pbrt:514:1: Texture \"t\" evaluates 513 textures for one value; the limit is 512"));
        EXPECT_EQ(refusal_of_world(nested_textures(type, 8, 2)), "") << type;  // 2^9 - 1
        EXPECT_THAT(refusal_of_world(nested_textures(type, 9, 2)), HasSubstr("evaluates 1023 textures"));
        EXPECT_THAT(refusal_of_world(nested_textures(type, 60, 2)), HasSubstr("scene.pbrt:11:1"));
    }
}

TEST(Limits, Constants_CostNothingHoweverDeep) {
    std::string text = "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [ 1 1 1 ]\n";
    for (int i = 0; i < 1000; ++i)
        text += "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"t\" \"texture tex2\" \"t\"\n";
    EXPECT_EQ(refusal_of_world(text), "");
}

class IncludeLimits : public ::testing::Test {
  protected:
    void write(const std::string& name, const std::string& text) const {
        std::ofstream(folder_ / name) << text;
    }
    std::string refusal() const {
        return error_of([&] {
            RecordingMonitor monitor;
            read_draft(read_text(folder_ / "scene.pbrt"), folder_ / "scene.pbrt", {}, monitor);
        });
    }
    std::size_t shapes() const {
        RecordingMonitor monitor;
        return read_draft(read_text(folder_ / "scene.pbrt"), folder_ / "scene.pbrt", {}, monitor)
            .quadrics.size();
    }
    static std::string includes(const std::string& file, int times) {
        std::string text;
        for (int i = 0; i < times; ++i) text += "Include \"" + file + "\"\n";
        return text;
    }
    testing::TemporaryFolder folder_;
};

TEST_F(IncludeLimits, AFileIncludedAgain_IsReadAgainFromMemory) {
    write("shape.pbrt", "Shape \"sphere\"\n");
    write("ten.pbrt", includes("shape.pbrt", 10));
    write("scene.pbrt", "WorldBegin\n" + includes("ten.pbrt", 100));
    EXPECT_EQ(shapes(), 1000U);
    // Each text is kept once.
    RecordingMonitor monitor;
    EXPECT_EQ(
        read_draft(read_text(folder_ / "scene.pbrt"), folder_ / "scene.pbrt", {}, monitor).sources.size(),
        3U);
}

TEST_F(IncludeLimits, FilesPastTheirNumber_AreRefusedWhereTheyAreNamed) {
    write("nothing.pbrt", "# nothing\n");
    write("many.pbrt", includes("nothing.pbrt", 10'000));
    write("scene.pbrt", "WorldBegin\n" + includes("many.pbrt", 7));
    EXPECT_THAT(refusal(),
                HasSubstr("many.pbrt:5530:1: Include \"nothing.pbrt\": more than 65536 included files"));
}

TEST_F(IncludeLimits, TextReadAgainPastItsBound_IsRefused) {
    write("long.pbrt", "#" + std::string(std::size_t{100} << 20, 'x') + "\n");
    write("scene.pbrt", "WorldBegin\n" + includes("long.pbrt", 6));
    EXPECT_EQ(refusal(), "no error");
    write("scene.pbrt", "WorldBegin\n" + includes("long.pbrt", 7));
    EXPECT_THAT(refusal(),
                HasSubstr("scene.pbrt:8:1: Include \"long.pbrt\": repeatedly included files exceed"));
}

// Blocks share inherited defaults; a block's own change ends with it, and explicit parameters win.
TEST(Limits, Defaults_HoldInTheirBlockAndYieldToWhatIsGiven) {
    const Read read = read_world(
        "Attribute \"shape\" \"float radius\" 2\n"
        "AttributeBegin AttributeBegin Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" AttributeEnd\n"
        "Shape \"sphere\" Shape \"sphere\" \"float radius\" 5 AttributeEnd\n"
        "Attribute \"shape\" \"float radius\" 7 Shape \"sphere\"");
    std::vector<float> radii;
    for (const Quadric& quadric : read.draft.quadrics) radii.push_back(quadric.radius);
    EXPECT_THAT(radii, ::testing::ElementsAre(3, 2, 5, 7));
    EXPECT_TRUE(read.warnings.empty() || read.warnings.front().find("radius") == std::string::npos);
}

TEST(Limits, DefaultsAndParametersPastTheirNumber_AreRefused) {
    std::string defaults, parameters;
    for (int i = 0; i < 64; ++i) defaults += fmt::format("Attribute \"shape\" \"float a{}\" 1\n", i);
    EXPECT_EQ(refusal_of_world(defaults + defaults), "") << "the same anew is no more";
    EXPECT_THAT(refusal_of_world(defaults + "Attribute \"shape\" \"float a64\" 1"),
                StartsWith("scene.pbrt:66:19: Attribute \"shape\" sets more than 64 defaults"));
    EXPECT_EQ(refusal_of_world(defaults + "Attribute \"light\" \"float a64\" 1"), "");
    for (int i = 0; i < 256; ++i) parameters += fmt::format(" \"float a{}\" 1", i);
    EXPECT_EQ(read_world("Shape \"sphere\"" + parameters).draft.quadrics.size(), 1U);
    EXPECT_THAT(refusal_of_world("Shape \"sphere\"" + parameters + " \"float b\" 1"),
                HasSubstr("has more than 256 parameters"));
}

}  // namespace limits_test
}  // namespace lucerna
