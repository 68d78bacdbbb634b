// The built command under mpirun gives the image of one process, bit for bit; also tests ranks that die, that
// are asked to stop, or that would render another picture.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/process/command.h"
#include "tests/process/good_files.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace mpi_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::Not;
using Words = std::vector<std::string>;

// A room with glass, fog in a box and a measured lamp.
constexpr const char* kScene = R"(
LookAt 0 0 -3.2  0 -0.1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 48 "integer yresolution" 40 "string filename" "a.exr"
Sampler "independent" "integer pixelsamples" 12
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.6 0.5 0.4 ]
Shape "trianglemesh" "point3 P" [ -1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1 ] "integer indices" [ 0 2 1 0 3 2 ]
Shape "trianglemesh" "point3 P" [ -1 1 -1  1 1 -1  1 1 1  -1 1 1 ] "integer indices" [ 0 1 2 0 2 3 ]
Shape "trianglemesh" "point3 P" [ -1 -1 1  1 -1 1  1 1 1  -1 1 1 ] "integer indices" [ 0 2 1 0 3 2 ]
Shape "trianglemesh" "point3 P" [ -1 -1 -1  -1 1 -1  -1 1 1  -1 -1 1 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
Material "dielectric" Translate 0.45 -0.65 -0.2 Shape "sphere" "float radius" 0.3
AttributeEnd
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 3 3 2 ]
Shape "trianglemesh" "point3 P" [ -0.3 0.97 -0.3  0.3 0.97 -0.3  0.3 0.97 0.3  -0.3 0.97 0.3 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeEnd
AttributeBegin
Translate 0 0.2 -0.9 Scale 5 5 5 LightSource "lightfield" "string filename" "lamp.exr"
AttributeEnd
)";
constexpr const char* kFog = R"(
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ 0.02 0.02 0.03 ] "rgb sigma_s" [ 0.3 0.3 0.2 ]
AttributeBegin
MediumInterface "fog" ""
Material "interface" Translate -0.45 -0.55 0.3 Shape "sphere" "float radius" 0.4
AttributeEnd
)";

struct Method {
    const char* name;
    Words options;
    bool fog = false;
};
void PrintTo(const Method& method, std::ostream* out) {
    *out << method.name;
}

class Mpi : public ::testing::TestWithParam<Method> {
  protected:
    void SetUp() override {
        std::ofstream(folder_ / "rig.toml") << std::string(kPlanes) + kDisc;
        const Finished made =
            run_command({"light", "acquire", "rig.toml", "-o", "lamp.exr"}, {folder_.path()});
        ASSERT_EQ(made.code, 0) << made.err;
        std::ofstream(folder_ / "scene.pbrt") << kScene;
        std::ofstream(folder_ / "fog.pbrt") << std::string(kScene) + kFog;
    }

    // Allows more ranks than processors, for any user.
    Start on(int ranks) const {
        Start start{folder_.path(), 120};
        start.launcher = {"mpirun", "--oversubscribe", "--bind-to", "none", "-n", std::to_string(ranks)};
        start.in_child = [own = sessions_.path().string()] {
            // Two mpirun that make the session folder of one user at the same time can fail.
            setenv("TMPDIR", own.c_str(), 1);
            for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"})
                setenv(name, "1", 1);
            setenv("OMP_WAIT_POLICY", "passive", 1);
            // On a single host no ssh is needed. Containers may not let processes read each other's memory.
            setenv("OMPI_MCA_plm", "isolated", 1);
            setenv("OMPI_MCA_btl_vader_single_copy_mechanism", "none", 1);
        };
        return start;
    }
    Finished alone(const Words& words) const { return run_command(words, {folder_.path(), 60}); }

    void expect_same_image(const std::string& a, const std::string& b) const {
        const Image one = read_exr(folder_ / a), other = read_exr(folder_ / b);
        EXPECT_EQ(one.channels, other.channels);
        EXPECT_TRUE(one.data == other.data) << a << ' ' << b;
    }

    TemporaryFolder folder_, sessions_;
};

Words with(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

class MpiEveryMethod : public Mpi {
  protected:
    void expect_the_image_of_one(const std::vector<int>& ranks) const {
        const Method& method = GetParam();
        const Words words = with({"render", method.fog ? "fog.pbrt" : "scene.pbrt", "--png", "--integrator",
                                  method.name, "--seed", "3"},
                                 method.options);
        const Finished expected = alone(with(words, {"-o", "one.exr"}));
        ASSERT_EQ(expected.code, 0) << expected.err;
        for (const int size : ranks) {
            for (const char* threads : {"1", "2"}) {
                SCOPED_TRACE(fmt::format("{} ranks of {} threads", size, threads));
                std::filesystem::remove(folder_ / "many.exr");
                const Finished result = run_command(
                    with(words, {"-o", "many.exr", "--threads", threads, "--stats", "many.json"}), on(size));
                ASSERT_EQ(result.code, 0) << result.out << result.err;
                expect_same_image("one.exr", "many.exr");
                EXPECT_EQ(read_bytes(folder_ / "one.png"), read_bytes(folder_ / "many.png"));
                // Only one rank prints.
                const std::size_t said = result.out.find("image    many.exr");
                EXPECT_NE(said, result.out.npos) << result.out;
                EXPECT_EQ(result.out.find("image    many.exr", said + 1), result.out.npos) << result.out;
                if (size > 1) {
                    EXPECT_THAT(read_text(folder_ / "many.json"), HasSubstr("\"ranks\": ["));
                }
            }
        }
    }
};

TEST_P(MpiEveryMethod, OnTwoRanks_IsTheImageOfOneProcess) {
    expect_the_image_of_one({2});
}
TEST_P(MpiEveryMethod, OnAnyRanks_IsTheImageOfOneProcess) {
    expect_the_image_of_one({1, 3, 8});
}

INSTANTIATE_TEST_SUITE_P(
    , MpiEveryMethod,
    ::testing::Values(Method{"path", {"--set", "guidelights=3000"}, true},
                      Method{"photonmap", {"--set", "photons=20000", "--set", "prepass=2000", "--spp", "8"}},
                      Method{"photonmap",
                             {"--set", "photons=20000", "--set", "direct=guided", "--layers", "--set",
                              "precompute=0", "--spp", "4"}},
                      Method{"igi", {"--set", "nsets=4", "--set", "prepass=2000", "--spp", "8"}, true},
                      Method{"progressive", {"--set", "photons=4000", "--set", "prepass=2000"}, true},
                      Method{"direct", {"--no-adaptive"}}));

// Returns the rank with that number among mpirun's children.
pid_t rank_of(pid_t mpirun, int number) {
    std::vector<pid_t> children;
    std::ifstream list(fmt::format("/proc/{0}/task/{0}/children", mpirun));
    for (pid_t child = 0; list >> child;) children.push_back(child);
    if (children.empty()) return -1;
    return children[static_cast<std::size_t>(number) % children.size()];
}

TEST_F(Mpi, KilledRankInEachPhase_EndsTheJobAndItGoesOnOnFewer) {
    const Words words{"render",       "scene.pbrt",
                      "--integrator", "photonmap",
                      "--set",        "photons=300000",
                      "--spp",        "64",
                      "--seed",       "3",
                      "--threads",    "1",
                      "--png",        "--stats",
                      "a.json",       "--checkpoint",
                      "a.checkpoint", "--resume",
                      "a.checkpoint", "--checkpoint-every",
                      "0.2s"};
    ASSERT_EQ(alone(with(words, {"-o", "one.exr"})).code, 0);
    int killed = 0;
    for (const char* phase : {"build scene", "photons", "irradiance", "image", "image"}) {
        SCOPED_TRACE(phase);
        if (killed < 4) std::filesystem::remove(folder_ / "a.checkpoint");
        SignalAt at = in_phase(SIGKILL, phase);
        at.to = [&](pid_t mpirun) { return rank_of(mpirun, killed); };
        if (std::string(phase) == "image")
            at.ready = [this](const std::string& out) {
                return has_begun(out, "image") && std::filesystem::exists(folder_ / "a.checkpoint");
            };
        // The phase may end before the signal is sent, or the signal may arrive after the job's end.
        Finished finished;
        for (int attempt = 0; attempt < 40 && !(finished.sent && finished.code != 0); ++attempt) {
            std::filesystem::remove(folder_ / "many.exr");
            if (attempt > 0) std::filesystem::remove(folder_ / "a.checkpoint");
            finished = run_command(with(words, {"-o", "many.exr"}), on(3), at);
        }
        ASSERT_TRUE(finished.sent);
        ++killed;
        EXPECT_EQ(finished.code, 128 + SIGKILL) << finished.err;
        EXPECT_THAT(finished.err, HasSubstr("signal 9"));
        EXPECT_FALSE(std::filesystem::exists(folder_ / "many.exr"));
    }
    const Finished second = run_command(with(words, {"-o", "many.exr"}), on(2));
    EXPECT_EQ(second.code, 0) << second.err;
    EXPECT_THAT(second.out, HasSubstr("resumed: "));
    expect_same_image("one.exr", "many.exr");
}

TEST_F(Mpi, AskedToStop_WritesWhatThereIsAndGoesOnAlone) {
    const Words words{"render",       "scene.pbrt",   "--integrator", "progressive", "--set",
                      "photons=2000", "--spp",        "1600",         "--seed",      "3",
                      "--png",        "--checkpoint", "a.checkpoint", "--resume",    "a.checkpoint"};
    ASSERT_EQ(alone(with(words, {"-o", "one.exr"})).code, 0);
    std::filesystem::remove(folder_ / "a.checkpoint");
    Start start = on(3);
    const auto in_child = start.in_child;
    start.in_child = [in_child] {
        in_child();
        // mpirun waits this number of seconds before it asks its ranks to end, and again before it kills
        // them.
        setenv("OMPI_MCA_odls_base_sigkill_timeout", "2", 1);
    };
    const Finished first = run_command(with(words, {"-o", "many.exr"}), start, in_phase(SIGINT, "passes"));
    ASSERT_TRUE(first.sent);
    EXPECT_NE(first.code, 0);
    EXPECT_THAT(first.err, HasSubstr("lucerna: stopped: ")) << first.out;
    EXPECT_TRUE(read_exr(folder_ / "many.exr").attributes.contains("lucerna.stopped"));
    const Finished second = alone(with(words, {"-o", "many.exr"}));
    EXPECT_EQ(second.code, 0) << second.err;
    EXPECT_THAT(second.out, HasSubstr("resumed: "));
    expect_same_image("one.exr", "many.exr");
}

TEST_F(Mpi, RanksThatWouldRenderAnotherPicture_AreRefusedByName) {
    const std::string program = LUCERNA_COMMAND;
    std::ofstream(folder_ / "other.pbrt") << kScene << "LightSource \"point\"\n";
    const std::string copy = (folder_ / "lucerna").string();
    std::filesystem::copy_file(program, copy);
    std::ofstream(copy, std::ios::app) << "another build";
    struct Other {
        Words command;
        std::string named;
    };
    for (const Other& other :
         {Other{{program, "render", "other.pbrt"}, "scene (hash of geometry, materials, lights and media)"},
          Other{{program, "render", "scene.pbrt", "--seed", "4"}, "its seed is 4"},
          Other{{program, "render", "scene.pbrt", "--set", "maxdepth=3"}, "parameter maxdepth"},
          Other{{copy, "render", "scene.pbrt"}, "program (hash of its file)"},
          Other{{program, "render", "nowhere.pbrt"}, "rank 1 on"}}) {
        SCOPED_TRACE(::testing::PrintToString(other.command));
        Words words{"render", "scene.pbrt", "-o", "a.exr", "--quiet", ":", "-n", "1"};
        const Finished finished = run_command(with(words, other.command), on(1));
        EXPECT_EQ(finished.code, 1) << finished.out << finished.err;
        EXPECT_THAT(finished.err, HasSubstr("lucerna: rank 1 on"));
        EXPECT_THAT(finished.err, HasSubstr(other.named));
        EXPECT_FALSE(std::filesystem::exists(folder_ / "a.exr"));
    }
}

// A rank without the scene's files receives them, and reports if they do not suffice.
TEST_F(Mpi, BroadcastScene_ReachesRanksThatDoNotHaveIt) {
    const Words words{"render", "scenes/scene.pbrt", "--spp", "4", "--broadcast-scene", "-o", "../many.exr"};
    for (const char* name : {"here/scenes", "here/lamps", "there"})
        std::filesystem::create_directories(folder_ / name);
    std::string scene = kScene;
    scene.replace(scene.find("lamp.exr"), 8, "../lamps/lamp.exr");
    std::ofstream(folder_ / "here/scenes/scene.pbrt") << scene;
    std::filesystem::copy_file(folder_ / "lamp.exr", folder_ / "here/lamps/lamp.exr");
    Start start = on(1);
    start.launcher.insert(start.launcher.end(), {"-wdir", (folder_ / "here").string()});
    Words all = words;
    all.insert(all.end(), {":", "-n", "2", "-wdir", (folder_ / "there").string(), LUCERNA_COMMAND});
    const Finished finished = run_command(with(all, words), start);
    EXPECT_EQ(finished.code, 0) << finished.out << finished.err;
    EXPECT_TRUE(std::filesystem::is_empty(folder_ / "there"));
    ASSERT_EQ(alone({"render", "here/scenes/scene.pbrt", "--spp", "4", "-o", "one.exr"}).code, 0);
    expect_same_image("one.exr", "many.exr");
    for (std::string& word : all) word = word == "--broadcast-scene" ? "--quiet" : word;
    const Finished refused =
        run_command(with(all, {"render", "scenes/scene.pbrt", "-o", "../many.exr"}), start);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("scenes/scene.pbrt: no such file"));
}

// Lamps and studies are also those of one process.
TEST_F(Mpi, LightAcquire_IsTheLampOfOneProcess) {
    std::ofstream(folder_ / "luminaire.pbrt")
        << "Camera \"perspective\" Film \"rgb\" WorldBegin\nTranslate 0 0 -0.02\n"
           "AreaLightSource \"diffuse\" \"rgb L\" [2 1 1] Shape \"disk\" \"float radius\" 0.006\n";
    std::ofstream(folder_ / "scene.toml")
        << std::string(kPlanes) + "kind = 'scene'\nfile = 'luminaire.pbrt'\nunit = 'W'\nrays = 200000\n";
    for (const char* rig : {"rig.toml", "scene.toml"}) {
        ASSERT_EQ(alone({"light", "acquire", rig, "-o", "one.exr"}).code, 0);
        for (const int size : {2, 3}) {
            SCOPED_TRACE(fmt::format("{}, {} ranks", rig, size));
            const Finished many = run_command({"light", "acquire", rig, "-o", "many.exr"}, on(size));
            ASSERT_EQ(many.code, 0) << many.out << many.err;
            EXPECT_EQ(read_bytes(folder_ / "one.exr"), read_bytes(folder_ / "many.exr"));
            EXPECT_EQ(read_bytes(folder_ / "one.cells"), read_bytes(folder_ / "many.cells"));
            EXPECT_FALSE(std::filesystem::exists(folder_ / "many.exr.part"));
            const std::size_t said = many.out.find("content hash");
            EXPECT_NE(said, many.out.npos) << many.out;
            EXPECT_EQ(many.out.find("content hash", said + 1), many.out.npos) << many.out;
        }
    }
    // One rank has another description.
    const Words words{"light", "acquire",       "rig.toml", "-o",      "no.exr",     ":",  "-n",
                      "1",     LUCERNA_COMMAND, "light",    "acquire", "scene.toml", "-o", "no.exr"};
    const Finished apart = run_command(words, on(1));
    EXPECT_EQ(apart.code, 1) << apart.out << apart.err;
    EXPECT_THAT(apart.err, HasSubstr("would measure a different lamp"));
}

TEST_F(Mpi, Study_HasTheErrorsOfOneProcess) {
    std::ofstream(folder_ / "study.toml") << R"(title = "Two ways"
seeds = 2
[[scene]]
file = "scene.pbrt"
resolution = "12x10"
[reference]
integrator = "path"
spp = [16]
[[method]]
name = "paths"
integrator = "path"
spp = [1, 4]
)";
    const Words words{"study", "study.toml", "--threads", "1", "-o"};
    ASSERT_EQ(alone(with(words, {"one"})).code, 0);
    const Finished many = run_command(with(words, {"many"}), on(3));
    ASSERT_EQ(many.code, 0) << many.out << many.err;
    EXPECT_THAT(many.out, HasSubstr("5/5  "));
    EXPECT_THAT(many.out, HasSubstr("renders  5 made, 0 found"));
    std::size_t images = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder_ / "one/runs")) {
        const std::string name = entry.path().filename().string();
        ASSERT_TRUE(std::filesystem::exists(folder_ / "many/runs" / name)) << name;
        if (!name.ends_with(".exr")) continue;
        expect_same_image("one/runs/" + name, "many/runs/" + name);
        ++images;
    }
    EXPECT_EQ(images, 5U);
    EXPECT_THAT(read_text(folder_ / "many/results.json"), HasSubstr("\"hosts\""));
    EXPECT_THAT(read_text(folder_ / "many/study.html"), HasSubstr("<th>hosts</th>"));
    EXPECT_THAT(read_text(folder_ / "one/results.json"), Not(HasSubstr("\"hosts\"")));
}

TEST_F(Mpi, OtherCommands_AreDoneOnceByRank0) {
    ASSERT_EQ(alone({"render", "scene.pbrt", "--spp", "1", "-o", "one.exr"}).code, 0);
    const Finished once = alone({"compare", "one.exr", "one.exr"});
    const Finished many = run_command({"compare", "one.exr", "one.exr"}, on(3));
    EXPECT_EQ(many.code, 0) << many.err;
    EXPECT_EQ(many.out, once.out);
    EXPECT_EQ(many.err,
              "lucerna: warning: this command runs on rank 0 only; render, light acquire and study share "
              "their work among ranks\n");
    const Finished help = run_command({"study", "--help"}, on(3));
    EXPECT_EQ(help.code, 0);
    EXPECT_EQ(help.out, alone({"study", "--help"}).out);
    const Finished wrong = run_command({"compare", "one.exr", "nowhere.exr"}, on(3));
    EXPECT_EQ(wrong.code, 1);
    EXPECT_THAT(wrong.err, HasSubstr("nowhere.exr: no such file"));
}

// srun without --mpi=pmix starts independent processes, each of which would write the same image.
TEST_F(Mpi, ManyProcessesWithoutMpi_AreRefusedUnlessTheyRenderParts) {
    Start start{folder_.path()};
    start.in_child = [] { setenv("SLURM_STEP_NUM_TASKS", "4", 1); };
    const Finished refused = run_command({"render", "scene.pbrt", "-o", "a.exr", "--spp", "1"}, start);
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.err, HasSubstr("has started 4 independent processes"));
    EXPECT_THAT(refused.err, HasSubstr("--mpi=pmix"));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "a.exr"));
    EXPECT_EQ(run_command({"render", "scene.pbrt", "-o", "a.exr", "--spp", "1", "--part", "1/4"}, start).code,
              0);
}

}  // namespace mpi_test
}  // namespace lucerna
