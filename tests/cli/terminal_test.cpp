// Names with control sequences must not reach the terminal, in every place that prints them.
#include <gmock/gmock.h>

#include "engine/cli/console.h"
#include "engine/image/image.h"
#include "lights/light_field.h"
#include "tests/cli/run_support.h"
#include "tests/lights/field_fixtures.h"

namespace lucerna {
namespace terminal_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;

constexpr const char* kEvil =
    "\x1b[31mevil\x1b]0;x\x07\xc2\x9b"
    "2J\r";

class Terminal : public testing::RunTest {
  protected:
    // Expects output without control characters that contains the escaped name.
    static void expect_plain(const std::vector<std::string>& words) {
        const Outcome outcome = lucerna_run(words);
        const std::string all = outcome.out + outcome.err;
        SCOPED_TRACE(::testing::PrintToString(words) + all);
        EXPECT_THAT(all, HasSubstr("evil"));
        for (const char c : all) {
            EXPECT_TRUE(static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t');
            EXPECT_NE(c, '\x7f');
        }
        EXPECT_EQ(all.find("\xc2\x9b"), all.npos);
    }
};

TEST_F(Terminal, NamesInScenes_DoNotReachIt) {
    const std::string evil = kEvil;
    const std::string named = std::string(testing::kScene);
    write("material.pbrt", named + "NamedMaterial \"" + evil + "\"\n");
    write("texture.pbrt", named + "Material \"diffuse\" \"texture reflectance\" \"" + evil + "\"\n");
    write("type.pbrt", named + "Material \"" + evil + "\"\n");
    write("parameter.pbrt", named + "Shape \"sphere\" \"float " + evil + "\" 1\n");
    write("missing.pbrt", named + "Shape \"plymesh\" \"string filename\" \"" + evil + ".ply\"\n");
    write("include.pbrt", named + "Include \"" + evil + "\"\n");
    write("lamp.pbrt", named + "LightSource \"lightfield\" \"string filename\" \"" + evil + "\"\n");
    write("object.pbrt", named + "ObjectInstance \"" + evil + "\"\n");
    for (const char* scene :
         {"material", "texture", "type", "parameter", "missing", "include", "lamp", "object"}) {
        expect_plain({"render", std::string(scene) + ".pbrt", "-o", "a.exr"});
        expect_plain({"info", std::string(scene) + ".pbrt"});
    }
    expect_plain({"render", "missing.pbrt", "-o", "a.exr", "--skip-missing"});
}

TEST_F(Terminal, NamesOfFilesAndWords_DoNotReachIt) {
    const std::string evil = kEvil;
    std::filesystem::copy("scene.pbrt", evil + ".pbrt");
    expect_plain({"render", evil + ".pbrt", "-o", evil + "/where.exr"});
    expect_plain({"render", "scene.pbrt", "-o", evil + ".exr", "--png"});
    expect_plain({"render", evil});
    expect_plain({evil});
    expect_plain({"render", "scene.pbrt", "--" + evil});
    expect_plain({"render", "scene.pbrt", "--set", evil + "=1"});
    expect_plain({"compare", evil, evil});
    expect_plain({"light", "info", evil});
}

TEST_F(Terminal, HeadersOfImagesAndLamps_DoNotReachIt) {
    Image image = Image::rgb(4, 4);
    image.attributes["said"] = kEvil;
    image.channels.push_back(std::string("n") + kEvil);
    image.data.assign(64, 1.0F);
    write_exr("a.exr", image);
    expect_plain({"info", "a.exr"});
    expect_plain({"compare", "a.exr", "a.exr"});
    const LightField plain = testing::random_field(testing::rig_b(), 0, 1, 7);
    LightFieldInfo info = plain.info();
    info.provenance = kEvil;
    write_light_field(
        "lamp.exr",
        LightField(plain.rig(), {plain.coefficients().begin(), plain.coefficients().end()}, info));
    expect_plain({"info", "lamp.exr"});
    expect_plain({"light", "info", "lamp.exr"});
}

TEST(PlainStreams, CharactersInPieces_ComeOutWhole) {
    std::ostringstream to;
    {
        PlainStream plain(to);
        for (const char c : std::string("ü…\x1b[2J日\xc2")) plain.put(c);
        plain << "\x9b" << std::flush;
        EXPECT_EQ(to.str(), "ü…\\x1b[2J日\\xc2\\x9b");
        plain << "\xe2\x80";
    }
    EXPECT_EQ(to.str(), "ü…\\x1b[2J日\\xc2\\x9b\\xe2\\x80");
}

TEST(PlainStreams, FailureOfTheStreamBehind_IsReported) {
    std::ostringstream to;
    to.setstate(std::ios::badbit);
    PlainStream plain(to);
    plain << "text" << std::flush;
    EXPECT_FALSE(plain);
}

}  // namespace terminal_test
}  // namespace lucerna
