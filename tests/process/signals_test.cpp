// A signal ends a command while it reads; while it renders, it requests a stop that keeps the image so far.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/process/command.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace signals_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Returns a scene of bodies of a million triangles, each of which takes about a second; several take longer
// than any test waits.
std::string scene(int bodies) {
    std::string text = R"(
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 64 "integer yresolution" 64 "string filename" "a.exr"
Sampler "independent" "integer pixelsamples" 100000
Integrator "path"
WorldBegin
LightSource "point" "rgb I" [ 3 3 3 ]
Shape "sphere" "float radius" 4
)";
    for (int i = 0; i < bodies; ++i) {
        text +=
            "Shape \"loopsubdiv\" \"integer levels\" 9 \"integer indices\" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]\n"
            "  \"point3 P\" [ 0.6 0.1 0.5  1 0.9 0.5  1.4 0.1 0.5  1 0.3 1.1 ]\n";
    }
    return text;
}

class Signals : public ::testing::TestWithParam<int> {
  protected:
    void SetUp() override {
        std::ofstream(folder_ / "long.pbrt") << scene(40);
        std::ofstream(folder_ / "short.pbrt") << scene(0);
        std::ofstream(folder_ / "study.toml")
            << "[[scene]]\nfile = \"long.pbrt\"\n[reference]\nintegrator = \"path\"\nspp = [1]\n"
               "[[method]]\nname = \"a\"\nintegrator = \"direct\"\nspp = [1]\n";
    }
    Finished run(const std::vector<std::string>& words, const SignalAt& when) const {
        return run_command(words, {folder_.path()}, when);
    }
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
            if (entry.is_regular_file()) names.push_back(entry.path().filename().string());
        }
        std::sort(names.begin(), names.end());
        return names;
    }

    TemporaryFolder folder_;
};

TEST_P(Signals, WhileReading_EndTheCommandWithinASecond) {
    const std::vector<std::string> before = files();
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"render", "long.pbrt", "-o", "a.exr", "--stats", "a.json"},
          std::vector<std::string>{"study", "study.toml", "-o", "out"}}) {
        SCOPED_TRACE(words[0]);
        const Finished finished = run(words, in_phase(GetParam(), "read scene"));
        EXPECT_FALSE(finished.waited);
        EXPECT_EQ(finished.signal, GetParam()) << finished.code << finished.out << finished.err;
        EXPECT_LT(finished.seconds, 1);
        EXPECT_FALSE(has_ended(finished.out, "read scene")) << finished.out;
    }
    EXPECT_EQ(files(), before);
}

TEST_P(Signals, WhileRendering_KeepWhatThereIsAndSaySo) {
    // Once an image is shown, there is a result to keep.
    const SignalAt shown{GetParam(), [this](const std::string& out) {
                             return has_begun(out, "image") && std::filesystem::exists(folder_ / "a.json");
                         }};
    const Finished finished = run(
        {"render", "short.pbrt", "-o", "a.exr", "--png", "--stats", "a.json", "--show-every", "0.1s"}, shown);
    ASSERT_TRUE(finished.sent);
    EXPECT_EQ(finished.code, 128 + GetParam()) << finished.signal << finished.out << finished.err;
    EXPECT_THAT(finished.err, StartsWith("lucerna: stopped: "));
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    EXPECT_EQ(files(), (std::vector<std::string>{"a.exr", "a.json", "a.png", "long.pbrt", "short.pbrt",
                                                 "study.toml"}));
    const Image image = read_exr(folder_ / "a.exr");
    EXPECT_TRUE(image.attributes.contains("lucerna.stopped"));
    EXPECT_TRUE(std::any_of(image.data.begin(), image.data.end(), [](float v) { return v > 0; }));
    EXPECT_THAT(read_text(folder_ / "a.json"), HasSubstr("\"complete\": false"));
}

INSTANTIATE_TEST_SUITE_P(Each, Signals, ::testing::Values(SIGINT, SIGTERM, SIGHUP), [](const auto& test) {
    return std::string(test.param == SIGINT ? "Interrupt" : test.param == SIGTERM ? "Terminate" : "HangUp");
});

using SignalsOfOneKind = Signals;

// Simulates nohup, and shells that start jobs in the background.
TEST_F(SignalsOfOneKind, IgnoredAtTheStart_StayIgnored) {
    Start how{folder_.path()};
    how.in_child = [] { std::signal(SIGHUP, SIG_IGN); };
    const Finished finished =
        run_command({"render", "short.pbrt", "-o", "a.exr", "--spp", "256"}, how, in_phase(SIGHUP, "image"));
    ASSERT_TRUE(finished.sent);
    EXPECT_EQ(finished.code, 0) << finished.err;
    EXPECT_FALSE(read_exr(folder_ / "a.exr").attributes.contains("lucerna.stopped"));
}

// Simulates `lucerna render ... | head -1`.
TEST_F(SignalsOfOneKind, ReaderOfTheOutputGone_TheImageIsWhole) {
    Start how{folder_.path()};
    how.close_after = 1;
    const Finished finished =
        run_command({"render", "short.pbrt", "-o", "a.exr", "--spp", "16", "--stats", "a.json"}, how);
    EXPECT_EQ(finished.code, 1);
    EXPECT_EQ(finished.err, "lucerna: standard output: cannot be written\n");
    EXPECT_FALSE(read_exr(folder_ / "a.exr").attributes.contains("lucerna.stopped"));
    EXPECT_THAT(read_text(folder_ / "a.json"), HasSubstr("\"complete\": true"));
}

}  // namespace signals_test
}  // namespace lucerna
