// `lucerna light acquire` with a rig file: no option overrides the file, the work is resumable, and errors
// are strict.
#include <atomic>
#include <csignal>

#include "engine/system/files.h"
#include "lights/light_field.h"
#include "lights/measurement/acquire.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace acquire_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;

constexpr const char* kRig =
    "[rig]\nsetup = 'A'\nviews = 6\nspacing = '4mm'\npixels = [12, 10]\npixel = '2mm'\ndistance = '40mm'\n"
    "[emitter]\nkind = 'disc'\nradius = '6mm'\nexponent = 20\nflux = 7\nunit = 'W'\nsetback = '2mm'\n";

class RunAcquire : public testing::RunTest {
  protected:
    void SetUp() override {
        testing::RunTest::SetUp();
        write("rig.toml", kRig);
    }
};

TEST_F(RunAcquire, RigFile_IsMeasured) {
    const Outcome outcome = lucerna_run({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(files(), (std::vector<std::string>{"lamp.cells", "lamp.exr", "rig.toml", "scene.pbrt"}));
    const LightField field = read_light_field("lamp.exr");
    EXPECT_EQ(field.rig().shift, V2i(2, 2));
    EXPECT_NEAR(double{field.rig().centre.z}, 0.002, 1e-12);
    EXPECT_EQ(field.info().unit, FluxUnit::watt);
    EXPECT_NEAR(field.info().captured + field.info().missed, 7, 0.01);
}

TEST_F(RunAcquire, Stopped_GoesOnToTheSameBytes) {
    ASSERT_EQ(lucerna_run({"light", "acquire", "rig.toml", "-o", "whole.exr", "--quiet"}).code, 0);
    const std::atomic<int> stop{SIGINT};
    ProcessContext around;
    around.stop = &stop;
    const std::vector<std::string> words = {"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"};
    const Outcome stopped = lucerna_run(words, around);
    EXPECT_EQ(stopped.code, 128 + SIGINT);
    EXPECT_THAT(stopped.err, AllOf(HasSubstr("stopped"), HasSubstr("continues from lamp.exr.part")));
    EXPECT_TRUE(std::filesystem::exists("lamp.exr.part"));
    EXPECT_FALSE(std::filesystem::exists("lamp.exr"));
    const Outcome outcome = lucerna_run(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists("lamp.exr.part"));
    EXPECT_EQ(read_bytes("lamp.exr"), read_bytes("whole.exr"));
}

TEST_F(RunAcquire, UnfinishedWorkOnAnotherRig_IsRefused) {
    AcquirePart("lamp.exr.part", 1).keep(0, std::array<float, 3>{1, 2, 3});
    expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"},
                   {"lamp.exr.part", "another description", "remove"});
}

// Work that is stopped or killed before its first column must not block another description.
TEST_F(RunAcquire, BegunWorkOnAnotherRigWithNothingDone_IsNoHindrance) {
    const std::atomic<int> stop{SIGINT};
    ProcessContext around;
    around.stop = &stop;
    std::string other = kRig;
    write("other.toml", other.replace(other.find("flux = 7"), 8, "flux = 8"));
    lucerna_run({"light", "acquire", "other.toml", "-o", "lamp.exr", "--quiet"}, around);
    ASSERT_TRUE(std::filesystem::exists("lamp.exr.part"));
    const Outcome outcome = lucerna_run({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists("lamp.exr.part"));
}

// A lamp that is too bright for a light field is discovered only at the end; the corrected description must
// then run.
TEST_F(RunAcquire, FailedWork_LeavesNothingThatBlocksTheMendedOne) {
    std::string bad = kRig;
    write("bad.toml", bad.replace(bad.find("flux = 7"), 8, "flux = 1e36"));
    expect_refused({"light", "acquire", "bad.toml", "-o", "lamp.exr", "--quiet"}, {"lucerna: "});
    const Outcome outcome = lucerna_run({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
}

TEST_F(RunAcquire, PlantedPart_IsNeitherFollowedNorWritten) {
    for (const char* target : {"precious", "missing"}) {
        write("precious", "");
        std::filesystem::create_symlink(target, "lamp.exr.part");
        expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"},
                       {"lamp.exr.part", "remove it"});
        EXPECT_EQ(std::filesystem::file_size("precious"), 0U);
        std::filesystem::remove("lamp.exr.part");
    }
}

TEST_F(RunAcquire, OptionsBesideARigFile_AreRefused) {
    expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--radius", "4mm"},
                   {"--radius", "rig.toml", "only without a rig file"});
    expect_refused({"light", "acquire", "none.toml", "-o", "lamp.exr"}, {"none.toml", "no such file"});
    write("bad.toml", std::string(kRig) + "focuss = '3m'\n");
    expect_refused({"light", "acquire", "bad.toml", "-o", "lamp.exr"}, {"bad.toml:15:", "focuss"});
}

TEST_F(RunAcquire, WithoutAFilter_ItSaysHowItIsToBeReconstructed) {
    const Outcome outcome =
        lucerna_run({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--filter", "none"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("without an optical filter"));
    EXPECT_EQ(read_light_field("lamp.exr").rig().filter_basis, FilterBasis::hat);
    expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--filter", "box"},
                   {"--filter", "box", "bell or none"});
    expect_refused(
        {"light", "acquire", "rig.toml", "-o", "lamp.exr", "--filter", "none", "--photographs", "p"},
        {"--filter", "--photographs"});
}

constexpr const char* kLuminaire =
    "Camera \"perspective\" Film \"rgb\" WorldBegin\n"
    "AreaLightSource \"diffuse\" Shape \"disk\" \"float radius\" 0.006\n";

// Returns the rig that is placed in front of a scene.
std::string rig_of_scene() {
    const std::string text = kRig;
    return text.substr(0, text.find("[emitter]")) +
           "[emitter]\nkind = 'scene'\nfile = 'lamp.pbrt'\nunit = 'W'\nrays = 1000\n";
}

TEST_F(RunAcquire, StrictWithADepartureInTheScene_IsRefused) {
    write("rig.toml", rig_of_scene());
    write("lamp.pbrt", kLuminaire);
    const std::vector<std::string> lenient = {"light", "acquire", "rig.toml", "-o", "lamp.exr", "--quiet"};
    std::vector<std::string> strict = lenient;
    strict.emplace_back("--strict");
    const Outcome clean = lucerna_run(strict);
    EXPECT_EQ(clean.code, 0) << clean.err;

    write("lamp.pbrt", std::string(kLuminaire) + "Material \"velvet\"\n");
    const Outcome warned = lucerna_run(lenient);
    EXPECT_EQ(warned.code, 0) << warned.err;
    EXPECT_THAT(warned.err, HasSubstr("velvet"));
    expect_refused(strict, {"lamp.pbrt:3:", "velvet"});
    expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--filter", "none"},
                   {"--filter", "disc, a rectangle or a projector"});
}

TEST_F(RunAcquire, StrictWithoutAScene_IsRefused) {
    expect_refused({"light", "acquire", "rig.toml", "-o", "lamp.exr", "--strict"}, {"--strict", "scene"});
    expect_refused({"light", "acquire", "-o", "lamp.exr", "--strict"}, {"--strict", "scene"});
}

TEST_F(RunAcquire, Projector_NeedsItsSlide) {
    std::string text = kRig;
    text = text.substr(0, text.find("[emitter]")) +
           "[emitter]\nkind = 'projector'\naperture = '10mm'\nfocal_length = '30mm'\nfocus = '300mm'\n"
           "slide_size = '10mm'\nflux = 3\nslide = 'slide.png'\n[quality]\ns_nodes = 1\nm_nodes = 1\n";
    write("projector.toml", text);
    const std::vector<std::string> words = {"light", "acquire",  "projector.toml",
                                            "-o",    "lamp.exr", "--quiet"};
    expect_refused(words, {"slide.png", "no such file"});
    std::filesystem::copy_file(std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes/lamps/projector/slide.png",
                               "slide.png");
    const Outcome outcome = lucerna_run(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const LightField field = read_light_field("lamp.exr");
    EXPECT_GT(field.flux(), 1);
    EXPECT_THAT(field.info().provenance, HasSubstr("slide projector"));
}

}  // namespace acquire_test
}  // namespace lucerna
