// Kills commands that make lamps, and studies, in every phase and while they write each file: each file is
// the old one or the new one, and the same command, repeated, ends with the files of an undisturbed run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/process/command.h"
#include "tests/process/good_files.h"
#include "tests/process/kill_at.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace lamps_and_studies_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

struct Making {
    std::string name;
    std::vector<std::string> prepare,
        words;                        // the command; OUT stands for the output's name without its suffix
    std::vector<std::string> files;   // the files that it writes, in order, as suffixes of names
    std::vector<std::string> phases;  // the phases that it must have

    friend void PrintTo(const Making& making, std::ostream* out) { *out << making.name; }
};

std::vector<Making> makings() {
    const std::vector<std::string> lamp{"light", "acquire", "-o",  "lamp.exr", "--threads",
                                        "2",     "--views", "5x5", "--pixels", "32x32"};
    return {{"acquire",
             {},
             {"light", "acquire", "-o", "OUT.exr", "--threads", "2", "--views", "5x5", "--pixels", "48x48"},
             {".exr", ".cells"},
             {"virtual acquisition", "cell table"}},
            {"import",
             lamp,
             {"light", "import", "rays.tm25ray", "-o", "OUT.exr", "--threads", "2"},
             {".exr", ".cells"},
             {"reading rays", "choosing the resolution", "projecting rays", "cell table"}},
            {"emit",
             lamp,
             {"light", "emit", "lamp.exr", "-o", "OUT.tm25ray", "--rays", "300000"},
             {".tm25ray"},
             {"writing rays"}}};
}

class KilledMaker : public ::testing::TestWithParam<Making> {
  protected:
    using Contents = std::map<std::string, std::vector<std::byte>>;

    void SetUp() override {
        if (!GetParam().prepare.empty()) {
            ASSERT_EQ(command().run(GetParam().prepare).code, 0);
            ASSERT_EQ(
                command().run({"light", "emit", "lamp.exr", "-o", "rays.tm25ray", "--rays", "50000"}).code,
                0);
        }
        const Ended undisturbed = command().run(words("out"));
        ASSERT_EQ(undisturbed.code, 0) << undisturbed.said;
        phases_ = phases_of(undisturbed);
        for (const std::string& file : GetParam().files)
            expected_[file] = read_bytes(folder_ / ("out" + file));
    }

    KillableCommand command() const { return KillableCommand(folder_.path()); }
    static std::vector<std::string> words(const std::string& out) {
        std::vector<std::string> all = GetParam().words;
        for (std::string& word : all) {
            if (word.starts_with("OUT")) word = out + word.substr(3);
        }
        return all;
    }

    // Returns an old file that cannot be mistaken for the new one: the beginning of such a file, since a cell
    // table does not replace a file of another kind.
    std::vector<std::byte> old_of(const std::string& file) const {
        constexpr std::ptrdiff_t kHead = 16;
        const std::vector<std::byte>& whole = expected_.at(file);
        return {whole.begin(), whole.begin() + kHead};
    }
    void begin_anew() const {
        remove_parts(folder_.path());
        for (const std::string& file : GetParam().files) {
            const std::vector<std::byte> old = old_of(file);
            std::ofstream(folder_ / ("out" + file), std::ios::binary)
                .write(reinterpret_cast<const char*>(old.data()), static_cast<std::streamsize>(old.size()));
        }
    }
    void expect_old_or_new(const std::string& where) const {
        for (const std::string& file : GetParam().files) {
            const std::vector<std::byte> now = read_bytes(folder_ / ("out" + file));
            EXPECT_TRUE(now == old_of(file) || now == expected_.at(file))
                << where << " " << file << now.size();
        }
    }
    void expect_made_all_the_same(const KillAt& when, const std::string& where) const {
        const Ended ended = command().kill(words("out"), when, [this] { begin_anew(); });
        ASSERT_TRUE(ended.in_place) << where << ": no kill fell there\n" << ended.said;
        expect_old_or_new(where);
        const Ended again = command().run(words("out"));
        ASSERT_EQ(again.code, 0) << where << again.said;
        for (const std::string& file : GetParam().files)
            EXPECT_TRUE(read_bytes(folder_ / ("out" + file)) == expected_.at(file)) << where << " " << file;
    }

    TemporaryFolder folder_;
    std::vector<std::string> phases_;
    Contents expected_;
};

TEST_P(KilledMaker, InAnyPhase_MadeAllTheSame) {
    EXPECT_THAT(phases_, IsSupersetOf(GetParam().phases));
    for (const std::string& phase : phases_) expect_made_all_the_same({phase, "", 1}, phase);
}

TEST_P(KilledMaker, WhileAFileIsWritten_MadeAllTheSame) {
    for (const std::string& file : GetParam().files) expect_made_all_the_same({"", "out" + file, 1}, file);
}

INSTANTIATE_TEST_SUITE_P(Lamps, KilledMaker, ::testing::ValuesIn(makings()),
                         [](const auto& test) { return test.param.name; });

// A luminaire in a scene file keeps its sums when the user interrupts it.
class StoppedLuminaire : public ::testing::Test {
  protected:
    void SetUp() override {
        const GoodFiles good(folder_.path());
        good.write("bulb.pbrt",
                   "Camera \"perspective\" Film \"rgb\" WorldBegin\nTranslate 0 0 -0.02\n"
                   "AreaLightSource \"diffuse\" Shape \"disk\" \"float radius\" 0.006\n");
        good.write("rig.toml",
                   std::string(kPlanes) + "kind = 'scene'\nfile = 'bulb.pbrt'\nunit = 'W'\nrays = 2200000\n");
        good.make(words("whole.exr"));
    }
    static std::vector<std::string> words(const std::string& out) {
        return {"light", "acquire", "rig.toml", "-o", out};
    }

    static constexpr double kPatience = 120;  // seconds, while other tests run
    TemporaryFolder folder_;
};

TEST_F(StoppedLuminaire, AmongItsLightPaths_GoesOnToTheSameBytes) {
    // The delay grows until some blocks of light paths are done, but not all.
    Finished stopped;
    double delay = 0.2;  // seconds within the phase
    for (int attempt = 0; attempt < 20; ++attempt, delay *= 1.3) {
        std::filesystem::remove(folder_ / "lamp.exr.part");
        std::filesystem::remove(folder_ / "lamp.exr");
        std::optional<std::chrono::steady_clock::time_point> begun;
        const SignalAt late{SIGINT, [&](const std::string& out) {
                                const auto now = std::chrono::steady_clock::now();
                                if (!begun && has_begun(out, "light paths")) begun = now;
                                return begun && now - *begun > std::chrono::duration<double>(delay) &&
                                       !has_ended(out, "light paths");
                            }};
        stopped = run_command(words("lamp.exr"), {folder_.path(), kPatience}, late);
        if (stopped.sent && stopped.err.find("after 0 of") == std::string::npos) break;
    }
    ASSERT_EQ(stopped.code, 128 + SIGINT) << stopped.out << stopped.err;
    EXPECT_THAT(stopped.err, HasSubstr("0 light paths; the same command continues from lamp.exr.part"));
    EXPECT_THAT(stopped.err, Not(HasSubstr("after 0 of")));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "lamp.exr"));

    const Finished resumed = run_command(words("lamp.exr"), {folder_.path(), kPatience});
    ASSERT_EQ(resumed.code, 0) << resumed.err;
    EXPECT_THAT(resumed.out, HasSubstr("continuing after "));
    EXPECT_FALSE(std::filesystem::exists(folder_ / "lamp.exr.part"));
    for (const char* end : {".exr", ".cells"})
        EXPECT_TRUE(read_bytes(folder_ / (std::string("lamp") + end)) ==
                    read_bytes(folder_ / (std::string("whole") + end)))
            << end;
}

// --- studies ---

constexpr const char* kStudy = R"(title = "Two ways"
seeds = 2
[[scene]]
file = "scene.pbrt"
resolution = "24x20"
[reference]
integrator = "path"
spp = [64]
[[method]]
name = "paths"
integrator = "path"
spp = [1, 4]
[[method]]
name = "photons"
integrator = "photonmap"
set = "photons=5000 gatherrays=1"
spp = [2]
)";
constexpr const char* kStudiedScene = R"(
LookAt 0 1 -3  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 24 "integer yresolution" 20
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.5 0 ]
)";

class KilledStudy : public ::testing::Test {
  protected:
    void SetUp() override {
        std::ofstream(folder_ / "scene.pbrt") << kStudiedScene;
        std::ofstream(folder_ / "study.toml") << kStudy;
        undisturbed_ = KillableCommand(folder_.path()).run(words("expected"));
        ASSERT_EQ(undisturbed_.code, 0) << undisturbed_.said;
        expected_ = table("expected");
        ASSERT_EQ(expected_.size(), 4U);
    }

    static std::vector<std::string> words(const std::string& out) {
        return {"study", "study.toml", "-o", out, "--threads", "2"};
    }
    std::filesystem::path out() const { return folder_ / "out"; }
    void begin_anew() const {
        std::filesystem::remove_all(out());
        std::filesystem::create_directories(out() / "runs");
        std::ofstream(out() / "results.csv") << "old";
    }

    // Returns the rows without the columns that depend on time: the seconds, and whether a point is among the
    // best.
    std::vector<std::string> table(const std::string& name) const {
        std::vector<std::string> rows;
        std::istringstream lines(read_text(folder_ / name / "results.csv"));
        for (std::string line; std::getline(lines, line);) {
            std::vector<std::string> cells;
            std::istringstream words(line);
            for (std::string cell; std::getline(words, cell, ',');) cells.push_back(cell);
            std::string row;
            for (std::size_t i = 0; i + 1 < cells.size(); ++i) row += i == 3 ? "" : cells[i] + ",";
            rows.push_back(row);
        }
        return rows;
    }

    void expect_same_table(const KillAt& when) const {
        const std::string where = when.phase + when.file + " " + std::to_string(when.count);
        const KillableCommand command(folder_.path());
        const Ended ended = command.kill(words("out"), when, [this] { begin_anew(); });
        ASSERT_TRUE(ended.in_place) << where << ": no kill fell there\n" << ended.said;
        const std::string results = read_text(out() / "results.csv");
        EXPECT_TRUE(results == "old" || table("out") == expected_) << where;
        for (const auto& entry : std::filesystem::directory_iterator(out() / "runs")) {
            if (entry.path().extension() != ".exr") continue;
            EXPECT_NO_THROW(read_exr(entry.path())) << where;
        }
        const Ended again = KillableCommand(folder_.path()).run(words("out"));
        ASSERT_EQ(again.code, 0) << where << again.said;
        EXPECT_EQ(table("out"), expected_) << where;
    }

    TemporaryFolder folder_;
    Ended undisturbed_;
    std::vector<std::string> expected_;
};

TEST_F(KilledStudy, WithinARender_SameTable) {
    const std::vector<std::string> phases = phases_of(undisturbed_);
    EXPECT_THAT(phases, IsSupersetOf({"read scene", "build scene", "photons", "irradiance", "image"}));
    for (const std::string& phase : phases) expect_same_table({phase, "", 1});
    for (const int render : {2, 4, 7}) expect_same_table({"image", "", render});
}

// A render writes its image and its notes one after the other; kills between them, and between renders.
TEST_F(KilledStudy, WhileAFileIsWritten_SameTable) {
    begin_anew();
    for (const int file : {1, 2, 3, 8, 13}) expect_same_table({"", "out/runs/", file});
    expect_same_table({"", "out/results.csv", 1});
    expect_same_table({"", "out/results.json", 1});
    expect_same_table({"", "out/study.html", 1});
}

}  // namespace lamps_and_studies_test
}  // namespace lucerna
