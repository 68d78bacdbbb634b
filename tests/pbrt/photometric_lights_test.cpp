// LightSource "ies" and "ldt": placement, units, errors.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "tests/support/error_of.h"
#include "tests/support/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace photometric_lights_test {

using namespace lucerna::testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class PhotometricLights : public ::testing::Test {
  protected:
    void SetUp() override {
        // The file has 100 cd at nadir, and at the horizon 10 cd at C0, 20 at C90, 30 at C180 and 40 at C270.
        write("odd.ies",
              "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 5 1 2 0 0 0\n1 1 9\n0 90 180\n0 90 180 270 360\n"
              "100 10 0\n100 20 0\n100 30 0\n100 40 0\n100 10 0\n");
        write("broken.ies", "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 five");
        write("tail.ies",
              "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 9\n0 180\n0\n1 1 and more\n");
    }
    // A lamp of 100 cd in all directions, with a disc of 0.6 m.
    void write_disc() const {
        write("disc.ies",
              "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 -0.6 -0.6 0\n1 1 9\n0 180\n0\n100 100\n");
    }
    void write(const std::string& name, std::string_view text) const { std::ofstream(folder / name) << text; }
    std::string lamp(const std::string& name, const std::string& parameters = "") const {
        return fmt::format("LightSource \"ies\" \"string filename\" \"{}\" {} ", (folder / name).string(),
                           parameters);
    }
    static double candela(const Light& light, const V3f& from, const V3f& towards) {
        const auto light_sample = light.sample_Li(from + 2.0F * towards, {0.5F, 0.5F});
        return light_sample ? 4 * static_cast<double>(light_sample->weight.y) : 0;
    }

    TemporaryFolder folder;
};

// A luminaire of two emitters, one above the other, gives two lights; a power is shared between them.
TEST_F(PhotometricLights, SeveralEmitters_AreLightsAtTheirPlaces) {
    const std::string point =
        "<LuminousData><IntData h=\"0\" v=\"0\">{0}</IntData><IntData h=\"0\" "
        "v=\"180\">{0}</IntData></LuminousData>";
    write("two.xml",
          fmt::format(
              "<IESTM33-22><Emitter>{}</Emitter><Emitter>{}<EmitterCenter><LengthOffset>0.5</LengthOffset>"
              "<HeightOffset>2</HeightOffset></EmitterCenter></Emitter></IESTM33-22>",
              fmt::format(fmt::runtime(point), 100), fmt::format(fmt::runtime(point), 300)));
    const auto lights_of = [&](const std::string& parameters) {
        return parts_of_world(
            fmt::format("Translate 5 0 0 LightSource \"photometric\" \"string filename\" \"{}\" {}",
                        (folder / "two.xml").string(), parameters));
    };
    const SceneParts parts = lights_of("");
    ASSERT_EQ(parts.lights.size(), 2U);
    const auto distance2 = [&](std::size_t i) {
        const auto sample = parts.lights[i]->sample_Li(V3f(5, 1, 0) - V3f(parts.origin), {0.5F, 0.5F});
        return sample ? (i == 0 ? 100.0 : 300.0) / static_cast<double>(sample->weight.y) : 0;
    };
    EXPECT_NEAR(distance2(0), 1, 1e-4);
    EXPECT_NEAR(distance2(1), 1.5 * 1.5 + 4, 1e-3) << "C90 is -y, and up is -z";
    const SceneParts rated = lights_of("\"float power\" 1000");
    EXPECT_NEAR(rated.lights[0]->power(), 250, 1e-2);
    EXPECT_NEAR(rated.lights[1]->power(), 750, 1e-2);
}

TEST_F(PhotometricLights, StraightFromTheFile_NadirIsZ_C0IsX_C90IsMinusY) {
    const SceneParts parts = parts_of_world(lamp("odd.ies"));
    const Light& light = *parts.lights.at(0);
    EXPECT_EQ(light.unit(), FluxUnit::lumen);
    EXPECT_NEAR(candela(light, V3f(0.0F), {0, 0, 1}), 100, 1e-3);
    EXPECT_NEAR(candela(light, V3f(0.0F), {1, 0, 0}), 10, 1e-3);
    EXPECT_NEAR(candela(light, V3f(0.0F), {0, -1, 0}), 20, 1e-3);
    EXPECT_NEAR(candela(light, V3f(0.0F), {-1, 0, 0}), 30, 1e-3);
    EXPECT_NEAR(candela(light, V3f(0.0F), {0, 1, 0}), 40, 1e-3);
}

TEST_F(PhotometricLights, HungUnderACeiling_NadirIsDown) {
    // The lamp hangs as in the documentation for y up: z is rotated to -y, C90 to -z.
    const SceneParts parts = parts_of_world("Translate 1 3 0 Rotate 90 1 0 0 " + lamp("odd.ies"));
    const Light& light = *parts.lights.at(0);
    const V3f at = V3f(V3d(1, 3, 0) - parts.origin);
    EXPECT_NEAR(candela(light, at, {0, -1, 0}), 100, 1e-3);
    EXPECT_NEAR(candela(light, at, {1, 0, 0}), 10, 1e-3);
    EXPECT_NEAR(candela(light, at, {0, 0, -1}), 20, 1e-3);
    EXPECT_NEAR(candela(light, at, {0, 0, 1}), 40, 1e-3);
}

TEST_F(PhotometricLights, ScaleAndColour_ActOnCandela_PowerSetsLumens) {
    const auto shining = [&](const std::string& parameters) {
        SceneParts parts = parts_of_world(lamp("odd.ies", parameters));
        return std::move(parts.lights.at(0));
    };
    const double lumens = shining("")->power();
    EXPECT_NEAR(shining("\"float scale\" 3")->power() / lumens, 3, 1e-5);
    EXPECT_NEAR(shining("\"float power\" 1500")->power(), 1500, 0.01);
    const auto red = shining("\"rgb color\" [4 1 1]");
    EXPECT_NEAR(red->power() / lumens, 1, 1e-5) << "a colour tints, lumens stay";
    EXPECT_NEAR(red->flux().x / red->flux().y, 4, 1e-4F);
    EXPECT_THAT(refusal_of_world(lamp("odd.ies", "\"rgb color\" [0 0 0]")), HasSubstr("is black"));
}

TEST_F(PhotometricLights, Emission_IsFromTheOpeningThatTheFileStates_OrFromAPoint) {
    write_disc();
    const auto light = [&](const std::string& world) {
        SceneParts parts = parts_of_world(world);
        return std::move(parts.lights.at(0));
    };
    EXPECT_FALSE(light(lamp("disc.ies"))->is_delta());
    EXPECT_FALSE(light(lamp("disc.ies", "\"string emission\" \"opening\""))->is_delta());
    EXPECT_TRUE(light(lamp("disc.ies", "\"string emission\" \"point\""))->is_delta());
    EXPECT_TRUE(light(lamp("odd.ies"))->is_delta()) << "no opening is stated";
    // A transformation's scale enlarges the lamp and keeps its flux.
    const auto large = light("Scale 2 2 2 " + lamp("disc.ies"));
    EXPECT_NEAR(large->bounds()->box.size().x, 1.2F, 1e-5F);
    EXPECT_NEAR(large->power(), light(lamp("disc.ies"))->power(), 1e-3);
    const std::string none = refusal_of_world(lamp("odd.ies", "\"string emission\" \"opening\""));
    EXPECT_THAT(none, HasSubstr("scene.pbrt:2:"));
    EXPECT_THAT(none, HasSubstr("odd.ies states no luminous opening with an area; expected \"point\""));
    EXPECT_THAT(refusal_of_world(lamp("disc.ies", "\"string emission\" \"sides\"")),
                HasSubstr("\"sides\" is unknown; expected opening or point"));
}

TEST_F(PhotometricLights, BadFiles_NameSceneAndFile) {
    const std::string broken = refusal_of_world(lamp("broken.ies"));
    EXPECT_THAT(broken, HasSubstr("scene.pbrt:2:"));
    EXPECT_THAT(broken, HasSubstr("broken.ies:3:10: the number of horizontal angles is \"five\""));
    EXPECT_THAT(refusal_of_world(lamp("none.ies")), HasSubstr("no such file"));
    EXPECT_THAT(refusal_of_world("LightSource \"ies\""), HasSubstr("lacks \"string filename\""));
    EXPECT_THAT(refusal_of_world("Scale 1 2 1 " + lamp("odd.ies")), HasSubstr("stretched"));
    EXPECT_THAT(read_world(lamp("tail.ies")).warnings, ElementsAre(HasSubstr("the text after the candela")));
}

std::vector<std::string> warnings_of(const std::string& world) {
    RecordingMonitor monitor;
    Draft draft = read_draft(std::string(kHead) + world + "\nShape \"sphere\"", "scene.pbrt", {}, monitor);
    assemble(std::move(draft), {1}, monitor);
    return monitor.warnings;
}

TEST_F(PhotometricLights, LumensAndWatts_InOneScene_AreOneWarningThatNamesBoth) {
    const std::string point = "LightSource \"point\" ";
    EXPECT_THAT(warnings_of(lamp("odd.ies") + "\n" + point + "\n" + point + "\n" + lamp("odd.ies")),
                ElementsAre(HasSubstr("scene.pbrt:3:1: this point light is in W, but the ies light at "
                                      "scene.pbrt:2:1 is in lm")));
    EXPECT_THAT(warnings_of(lamp("odd.ies") + lamp("odd.ies")), IsEmpty());
    EXPECT_THAT(warnings_of(point + point), IsEmpty());
}

}  // namespace photometric_lights_test
}  // namespace lucerna
