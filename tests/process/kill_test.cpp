// Kills the built command (SIGKILL) in every phase and starts it again: the final files are those of an
// undisturbed run, and no file is ever half written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "engine/base/sampler.h"
#include "engine/image/image.h"
#include "engine/render/checkpoint.h"
#include "engine/system/files.h"
#include "tests/process/kill_at.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace kill_test {

// A room with a lamp, a mirror ball and many spheres of many triangles, so that reading also takes time.
constexpr const char* kScene = R"(
LookAt 0 1 -3.9  0 1 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 96 "integer yresolution" 80 "string filename" "picture.exr"
Sampler "independent" "integer pixelsamples" 16
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.6 0.5 0.4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 0 2  2 0 2  2 0 -4 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -4  -2 2 -4  -2 2 2  -2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.7 0 ]
Shape "loopsubdiv" "integer levels" 6 "integer indices" [ 0 1 2 0 2 3 0 3 1 1 3 2 ]
  "point3 P" [ 0.6 0.1 0.5  1 0.9 0.5  1.4 0.1 0.5  1 0.3 1.1 ]
Material "conductor"
Shape "sphere" "float radius" 0.3
)";

class Killed : public ::testing::TestWithParam<const char*> {
  protected:
    void SetUp() override { std::ofstream(folder_ / "scene.pbrt") << kScene; }

    // Runs the command and kills it after `seconds` (< 0: never). Returns the exit code, or 128 + the signal
    // that ended it.
    int run(const std::vector<std::string>& more, double seconds) const {
        std::vector<std::string> words = command_line(more);
        words.insert(words.begin(), LUCERNA_COMMAND);
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        const pid_t child = fork();
        if (child == 0) {
            if (chdir(folder_.path().c_str()) == 0) execv(argv[0], argv.data());
            _exit(127);
        }
        if (seconds >= 0) {
            std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
            kill(child, SIGKILL);
        }
        int status = 0;
        waitpid(child, &status, 0);
        return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
    }

    static std::vector<std::string> command_line(const std::vector<std::string>& more) {
        std::vector<std::string> words{"render",    "scene.pbrt", "--integrator", GetParam(),
                                       "--threads", "2",          "--quiet"};
        for (const char* word : settings()) words.emplace_back(word);
        words.insert(words.end(), more.begin(), more.end());
        return words;
    }

    static std::vector<const char*> settings() {
        const std::string name = GetParam();
        if (name == "photonmap") return {"--set", "photons=50000", "--set", "gatherrays=2"};
        if (name == "progressive") return {"--set", "photons=20000"};
        if (name == "igi") return {"--set", "nlights=16", "--set", "nsets=4", "--set", "causticpaths=20000"};
        return {};
    }

    // Expects all existing files to be complete, either the old or the new version.
    void expect_whole_files() const {
        std::error_code status;
        if (std::filesystem::exists(folder_ / "a.exr", status)) {
            EXPECT_EQ(read_exr(folder_ / "a.exr").width, 96);
        }
        if (std::filesystem::exists(folder_ / "a.png", status)) {
            const std::vector<std::byte> png = read_bytes(folder_ / "a.png");
            ASSERT_GT(png.size(), 12U);
            // IEND and its CRC are the last eight bytes of any complete PNG.
            EXPECT_EQ(std::string(reinterpret_cast<const char*>(&png[png.size() - 8]), 4), "IEND");
        }
        if (std::filesystem::exists(folder_ / "c", status)) {
            EXPECT_NO_THROW(load_checkpoint(folder_ / "c"));
        }
    }

    testing::TemporaryFolder folder_;
};

// Kills at times spread over the whole of an undisturbed run: reading, preparing, rendering, writing.
TEST_P(Killed, AtAnyTime_ResumesToTheSameFiles) {
    const std::vector<std::string> words{
        "-o", "a.exr",    "--png", "--show-every",       "0.02s", "--checkpoint",
        "c",  "--resume", "c",     "--checkpoint-every", "0.02s"};
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_EQ(run({"-o", "expected.exr", "--png", "--show-every", "0.02s", "--checkpoint", "e",
                   "--checkpoint-every", "0.02s"},
                  -1),
              0);
    const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const Image expected = read_exr(folder_ / "expected.exr");
    const std::vector<std::byte> picture = read_bytes(folder_ / "expected.png");

    Sampler random(5, Purpose::test, 0, 0);
    int kills = 0;
    for (int round = 0; round < 4; ++round) {
        for (const char* name : {"a.exr", "a.png", "c"}) std::filesystem::remove(folder_ / name);
        int code = 0;
        do {
            const double share = kills % 2 == 0 ? 0.1 * (1 + kills % 10) : double{random.next()};
            code = run(words, whole * share * 1.1);
            ASSERT_TRUE(code == 0 || code == 128 + SIGKILL) << code;
            kills += code != 0;
            expect_whole_files();
            ASSERT_LT(kills, 100) << "it never ends";
        } while (code != 0 && kills % 3 != 0);
        if (code != 0) {  // runs undisturbed to the end
            ASSERT_EQ(run(words, -1), 0);
        }
        EXPECT_EQ(expected.data, read_exr(folder_ / "a.exr").data);
        EXPECT_EQ(picture, read_bytes(folder_ / "a.png"));
    }
    EXPECT_GT(kills, 3);
}

// Kills while the final files are being written, once for each of them.
TEST_P(Killed, WhileItWrites_LeavesWholeFiles) {
    const std::vector<std::string> words{"-o",           "a.exr", "--png",    "--spp", "2",
                                         "--checkpoint", "c",     "--resume", "c"};
    ASSERT_EQ(run(words, -1), 0);
    const Image expected = read_exr(folder_ / "a.exr");
    const testing::KillableCommand command(folder_.path());
    for (const char* const file : {"a.exr", "a.png", "c"}) {
        // Nothing is left to render, so the command reads and then only writes.
        const testing::Ended ended =
            command.kill(command_line(words), {"", file, 1}, [&] { testing::remove_parts(folder_.path()); });
        ASSERT_TRUE(ended.killed && ended.in_place) << file << ": no kill fell there\n" << ended.said;
        expect_whole_files();
        EXPECT_EQ(expected.data, read_exr(folder_ / "a.exr").data) << file;
    }
}

INSTANTIATE_TEST_SUITE_P(EveryIntegrator, Killed,
                         ::testing::Values("path", "direct", "photonmap", "igi", "progressive"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace kill_test
}  // namespace lucerna
