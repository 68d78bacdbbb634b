// --checkpoint and --resume on the command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <csignal>

#include <algorithm>

#include "engine/image/image.h"
#include "engine/render/checkpoint.h"
#include "engine/scene/arithmetic.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace checkpoint_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

class CheckpointCommand : public testing::RunTest {
  protected:
    static Outcome render(std::vector<std::string> more) {
        std::vector<std::string> words{"render", "scene.pbrt"};
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome;
    }
};

TEST_F(CheckpointCommand, MoreSamples_ImageOfOneRender) {
    render({"--spp", "3", "-o", "a.exr", "--checkpoint", "c"});
    const Outcome outcome = render({"--spp", "8", "-o", "a.exr", "--resume", "c", "--threads", "3"});
    EXPECT_THAT(outcome.out, HasSubstr("resumed: 3 samples per pixel, rendered in "));
    EXPECT_THAT(outcome.out, HasSubstr("continue --resume c"));
    render({"--spp", "8", "-o", "b.exr"});
    EXPECT_EQ(read_exr("a.exr").data, read_exr("b.exr").data);
    // The resumed checkpoint is kept up to date.
    EXPECT_THAT(render({"--spp", "9", "-o", "a.exr", "--resume", "c"}).out, HasSubstr("resumed: 8 samples"));
}

TEST_F(CheckpointCommand, SameFileForBoth_BeginsWhereThereIsNone) {
    const std::vector<std::string> words{"--spp", "2", "-o", "a.exr", "--checkpoint", "c", "--resume", "c"};
    EXPECT_THAT(render(words).out, HasSubstr("no checkpoint c yet: the render starts from the beginning"));
    EXPECT_THAT(render(words).out, HasSubstr("resumed: 2 samples"));
}

TEST_F(CheckpointCommand, AnotherFileToKeep_LeavesTheFirst) {
    render({"--spp", "2", "-o", "a.exr", "--checkpoint", "c"});
    const auto before = read_bytes("c");
    render({"--spp", "4", "-o", "a.exr", "--resume", "c", "--checkpoint", "d"});
    EXPECT_EQ(read_bytes("c"), before);
    EXPECT_THAT(render({"--spp", "5", "-o", "a.exr", "--resume", "d"}).out, HasSubstr("resumed: 4 samples"));
}

TEST_F(CheckpointCommand, OfAnotherRender_IsRefusedByWhatDiffers) {
    render({"--spp", "2", "-o", "a.exr", "--checkpoint", "c"});
    const auto refused = [this](std::vector<std::string> more, std::vector<std::string> named) {
        std::vector<std::string> words{"render", "scene.pbrt", "-o", "a.exr", "--resume", "c"};
        words.insert(words.end(), more.begin(), more.end());
        named.emplace_back("c: the checkpoint is from a different render: its ");
        expect_refused(words, named);
    };
    refused({"--seed", "5"}, {"seed is 0, here it is 5"});
    refused({"--resolution", "20x20"}, {"image size is 12 x 8, here it is 20 x 20"});
    refused({"--integrator", "direct"}, {"integrator is path, here it is direct"});
    refused({"--unit", "photometric"}, {"unit of light is that of each light, here it is photometric"});
    refused({"--set", "maxdepth=2"}, {"parameter maxdepth is 4, here it is 2"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--resume", "c", "--spp", "1"},
                   {"holds up to 2 samples per pixel; --spp 1 is too small"});
    write("scene.pbrt", std::string(testing::kScene) + "LightSource \"point\"\n");
    refused({}, {"scene (hash of geometry, materials, lights and media)"});
    std::string moved = testing::kScene;
    moved.replace(moved.find("LookAt 0 1 -3"), 13, "LookAt 0 1 -4");
    write("scene.pbrt", moved);
    refused({}, {"view (hash of camera, film and calculation surfaces)"});
    write("scene.pbrt", std::string(testing::kScene) + "# a word more\n");
    render({"--spp", "2", "-o", "a.exr", "--resume", "c"});
}

TEST_F(CheckpointCommand, FileThatTheSceneNames_IsPartOfIt) {
    write("more.pbrt", "Shape \"sphere\" \"float radius\" 0.2\n");
    write("scene.pbrt", std::string(testing::kScene) + "Include \"more.pbrt\"\n");
    render({"--spp", "2", "-o", "a.exr", "--checkpoint", "c"});
    render({"--spp", "3", "-o", "a.exr", "--resume", "c"});
    write("more.pbrt", "Shape \"sphere\" \"float radius\" 0.3\n");
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--resume", "c"},
                   {"scene (hash of geometry, materials, lights and media)"});
}

TEST_F(CheckpointCommand, UnusableFiles_AreRefusedBeforeTheSceneIsRead) {
    write("scene.pbrt", "this is no scene");
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--resume", "none"}, {"none: no such file"});
    write("c", "something else entirely, that is no checkpoint");
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--resume", "c"}, {"c: is not a checkpoint"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--checkpoint", "no/where"},
                   {"the folder no does not exist"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--checkpoint", "./a.exr"},
                   {"is already the output of", "choose another file"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--checkpoint", "c", "--checkpoint-every", "5"},
                   {"--checkpoint-every", "\"5\""});
}

// The sums of another build are not, to the bit, those of this one.
TEST_F(CheckpointCommand, OfAnotherBuild_IsRefusedAndBothAreNamed) {
    render({"--spp", "2", "-o", "a.exr", "--checkpoint", "c"});
    Checkpoint checkpoint = load_checkpoint("c");
    const auto fact = std::find_if(checkpoint.facts.begin(), checkpoint.facts.end(),
                                   [](const auto& f) { return f.first == "arithmetic"; });
    ASSERT_NE(fact, checkpoint.facts.end());
    EXPECT_EQ(fact->second, arithmetic());
    fact->second = "native, x86-64-v4, Embree avx512, g++ 1";
    save_checkpoint("c", checkpoint);
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--spp", "4", "--resume", "c"},
                   {"arithmetic", fact->second, arithmetic()});
}

// A request to stop before any sample is done leaves no image, but a checkpoint to start from.
TEST_F(CheckpointCommand, StoppedByTheUser_GoesOn) {
    const std::atomic<int> stop{SIGINT};
    const Outcome stopped = lucerna_run(
        {"render", "scene.pbrt", "--spp", "4", "-o", "a.exr", "--checkpoint", "c"}, {false, &stop});
    EXPECT_EQ(stopped.code, 128 + SIGINT);
    EXPECT_FALSE(std::filesystem::exists("a.exr"));
    render({"--spp", "4", "-o", "a.exr", "--resume", "c"});
    render({"--spp", "4", "-o", "b.exr"});
    EXPECT_EQ(read_exr("a.exr").data, read_exr("b.exr").data);
}

}  // namespace checkpoint_test
}  // namespace lucerna
