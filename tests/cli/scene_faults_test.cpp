// Runs the commands on small scenes of tests/cli/faults that expose wrong or missing light.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace scene_faults_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

std::string fault(const std::string& name) {
    return LUCERNA_SOURCE_DIR "/tests/cli/faults/" + name;
}

class RunFaults : public testing::RunTest {
  protected:
    // Returns the mean illuminance of the one surface that `options` name.
    static double lux(const std::string& scene, std::vector<std::string> options) {
        std::vector<std::string> words{"lux", scene, "--json", "lux.json", "--quiet"};
        words.insert(words.end(), options.begin(), options.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return nlohmann::json::parse(read_text("lux.json"))["surfaces"][0]["mean"]["value"];
    }
    // Returns the mean luminance of the picture.
    static double mean(const std::string& scene, const std::string& method, const std::string& spp,
                       const std::vector<std::string>& options = {}) {
        std::vector<std::string> words{"render",       scene,   "-o", "mean.exr",     "--quiet",
                                       "--no-denoise", "--spp", spp,  "--integrator", method};
        words.insert(words.end(), options.begin(), options.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        const Image image = read_exr("mean.exr");
        double sum = 0;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) sum += static_cast<double>(luminance(image.rgb_at(x, y)));
        }
        return sum / image.width / image.height;
    }
};

// The floor is 5 m below the lamp; the disc's illuminance on its axis is pi L r² / (r² + d²).
TEST_F(RunFaults, MirroredQuadrics_LightTheFloorAsTheirTwins) {
    const std::vector<std::string> floor{
        "--surface", "p=-0.01,-5,-0.01:-0.01,-5,0.01:0.01,-5,-0.01", "--spacing", "1", "--samples", "1"};
    const double disc = M_PI * 10 * 0.25 / 25.25;
    EXPECT_NEAR(lux(fault("mirrored/s_disk.pbrt"), floor), disc, 2e-3 * disc);
    EXPECT_NEAR(lux(fault("mirrored/m_disk.pbrt"), floor), disc, 2e-3 * disc);
    const double cone = lux(fault("mirrored/s_cone.pbrt"), floor);
    EXPECT_GT(cone, 0.1);
    EXPECT_NEAR(lux(fault("mirrored/m_cone.pbrt"), floor), cone, 5e-3 * cone);
}

// The expected 0.209 and 0.419 are pbrt-v4's results.
TEST_F(RunFaults, PowerWithScale_IsPbrts) {
    EXPECT_NEAR(mean(fault("power-scale/k_point1.pbrt"), "path", "16"), 0.209, 0.003);
    EXPECT_NEAR(mean(fault("power-scale/k_point2.pbrt"), "path", "16"), 0.419, 0.006);
}

TEST_F(RunFaults, ModelsWithIesLampsAndInstances_AreReadWhole) {
    Outcome outcome = lucerna_run({"import", fault("gltf/ext_ies.gltf"), "-o", "ies.pbrt"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("1 lights"), Not(HasSubstr("no light"))));
    EXPECT_THAT(read_text("ies.pbrt"), AllOf(HasSubstr("LightSource \"ies\""), Not(HasSubstr("infinite"))));
    outcome = lucerna_run({"import", fault("gltf/gpuinst.gltf"), "-o", "instances.pbrt"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("2 shapes, 4 triangles"));
}

// The window transmits as a pane does. Under the sky alone, the mean over 54 points is 1310 ± 2 lx by paths
// that pass the pane only by chance (the sky is large enough for that), 1541 ± 2 without the pane, and half
// as much if the window is one surface of a solid.
TEST_F(RunFaults, OfficeWindowOfAModel_IsAPane) {
    const Outcome outcome = lucerna_run({"import", fault("gltf/office-window.gltf"), "-o", "office.pbrt"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    std::string text = read_text("office.pbrt");
    const std::size_t sun = text.find("LightSource \"distant\"");
    ASSERT_NE(sun, std::string::npos);
    text.erase(sun, text.find('\n', text.find("point3 to", sun)) - sun);
    write("sky.pbrt", text);
    EXPECT_NEAR(lux("sky.pbrt", {"--height", "0.75", "--samples", "16"}), 1310, 0.02 * 1310);
}

// Returns a scene of a disc above a floor, in one of several ways.
std::string lamps(const std::string& of_lights) {
    return R"(Option "string unit" "photometric"
LookAt 0 1 -2  0 0.8 0  0 1 0
Camera "perspective" "float fov" 60
Film "rgb" "integer xresolution" 16 "integer yresolution" 16 "string filename" "x.exr"
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "bilinearmesh" "point3 P" [ -2 0 -2  2 0 -2  -2 0 2  2 0 2 ]
Shape "bilinearmesh" "point3 P" [ -2 0 2  2 0 2  -2 2 2  2 2 2 ]
Translate 0 1.5 0 Rotate 90 1 0 0
)" + of_lights;
}

std::string disc(double radiance, const std::string& more = "") {
    return fmt::format(
        "AttributeBegin {1} AreaLightSource \"diffuse\" \"rgb L\" [ {0} {0} {0} ] Shape \"disk\" "
        "\"float radius\" 0.5 AttributeEnd\n",
        radiance, more);
}

// Two coincident lamps are twice as bright by every technique: by camera rays, by next-event estimation, by
// photons, and on a surface.
TEST_F(RunFaults, CoincidentLamps_CountAsBoth) {
    write("one.pbrt", lamps(disc(10)));
    write("two.pbrt", lamps(disc(4) + disc(6)));
    write("back.pbrt", lamps(disc(10) + disc(10, "ReverseOrientation")));
    const std::vector<std::string> floor{
        "--surface", "p=-1,0.5,-1:-1,0.5,1:1,0.5,-1", "--spacing", "1", "--samples", "1"};
    const double lit = lux("one.pbrt", floor);
    EXPECT_NEAR(lux("two.pbrt", floor), lit, 0.01 * lit);
    EXPECT_NEAR(lux("back.pbrt", floor), lit, 0.05 * lit);  // the wall also lights the floor from below
    for (const std::string method : {"path", "photonmap", "direct"}) {
        SCOPED_TRACE(method);
        const double one = mean("one.pbrt", method, "64");
        EXPECT_NEAR(mean("two.pbrt", method, "64"), one, 0.02 * one);
    }
    const Outcome info = lucerna_run({"info", "two.pbrt"});
    EXPECT_THAT(info.out, AllOf(HasSubstr("1 area, 24.674 lm"), HasSubstr("both count, as one light")));
}

TEST_F(RunFaults, OverlappingLamps_AreWarnedOf) {
    write("overlap.pbrt", lamps(disc(10) + "Translate 0.2 0 0 " + disc(10)));
    const Outcome info = lucerna_run({"info", "overlap.pbrt"});
    EXPECT_THAT(info.out, HasSubstr("coincides in part with that of the light at"));
    write("apart.pbrt", lamps(disc(10) + "Translate 1.1 0 0 " + disc(10)));
    EXPECT_THAT(lucerna_run({"info", "apart.pbrt"}).out, Not(HasSubstr("coincides")));
}

TEST_F(RunFaults, SceneInMillimetres_IsAskedForItsScale) {
    const std::string room =
        "Camera \"perspective\" Film \"rgb\" WorldBegin LightSource \"point\" Shape \"sphere\" "
        "\"float radius\" 1400\n";
    write("mm.pbrt", "Option \"string unit\" \"photometric\"\n" + room);
    EXPECT_THAT(lucerna_run({"info", "mm.pbrt"}).out,
                AllOf(HasSubstr("lengths are metres"), HasSubstr("Scale 0.001 0.001 0.001")));
    write("m.pbrt", "Option \"string unit\" \"photometric\"\n" + lamps(""));
    EXPECT_THAT(lucerna_run({"info", "m.pbrt"}).out, Not(HasSubstr("lengths are metres")));
    write("empty.pbrt", "Camera \"perspective\" Film \"rgb\" WorldBegin LightSource \"point\"\n");
    EXPECT_THAT(lucerna_run({"info", "empty.pbrt"}).out, HasSubstr("the scene has no shapes"));
    EXPECT_THAT(lucerna_run({"lux", "m.pbrt", "--heigth", "1"}).err,
                HasSubstr("unknown option --heigth; did you mean \"--height\"?"));
}

}  // namespace scene_faults_test
}  // namespace lucerna
