// The whole command: its help, and how it refuses bad input.
#include "engine/cli/run.h"
#include "engine/base/version.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <streambuf>

#include "engine/scene/arithmetic.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace run_test {

using ::testing::HasSubstr;
using testing::lucerna_run;
using testing::Outcome;

using RunHelp = testing::RunTest;
using RunErrors = testing::RunTest;

std::vector<std::string> split(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

// --- help ---

const std::vector<std::vector<std::string>> kCommands = {
    {},          {"render"},      {"light"}, {"light", "import"}, {"light", "acquire"}, {"light", "info"},
    {"compare"}, {"falsecolour"}, {"info"}};

TEST_F(RunHelp, EveryCommand_ExitsZeroWithExamples) {
    for (std::vector<std::string> words : kCommands) {
        words.push_back("--help");
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0);
        EXPECT_THAT(outcome.out, HasSubstr("Examples:\n  lucerna "));
        EXPECT_EQ(outcome.err, "");
    }
}

TEST_F(RunHelp, Program_NamesEveryCommand) {
    const std::string help = lucerna_run({"--help"}).out;
    for (const char* name : {"render", "light", "compare", "falsecolour", "info"})
        EXPECT_THAT(help, HasSubstr(name));
    const std::string light = lucerna_run({"light", "--help"}).out;
    for (const char* name : {"import", "acquire", "info"}) EXPECT_THAT(light, HasSubstr(name));
}

TEST_F(RunHelp, NoCommand_PrintsHelpAndExitsOne) {
    const Outcome outcome = lucerna_run({});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.out, HasSubstr("Examples:"));
    EXPECT_THAT(outcome.err, HasSubstr("a command is missing"));
}

TEST_F(RunHelp, Version_IsSaid) {
    const Outcome outcome = lucerna_run({"--version"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "lucerna " + std::string(program_version()) + "\n" + arithmetic() + "\n");
}

// Files are missing or of the wrong kind, so nothing is written, but every word of an example must be
// accepted.
TEST_F(RunHelp, EveryExample_Parses) {
    for (std::vector<std::string> command : kCommands) {
        command.push_back("--help");
        std::istringstream help(lucerna_run(command).out);
        int examples = 0;
        for (std::string line; std::getline(help, line);) {
            if (!line.starts_with("  lucerna ")) continue;
            ++examples;
            std::vector<std::string> words = split(line);
            words.erase(words.begin());
            if (words[0] == "light" &&
                words[1] == "acquire") {  // it needs no input: the test makes its output folder missing
                std::replace(words.begin(), words.end(), std::string("lamp.exr"),
                             std::string("none/lamp.exr"));
            }
            const Outcome outcome = lucerna_run(words);
            if (outcome.code == 0) continue;
            EXPECT_THAT(outcome.err, ::testing::AnyOf(HasSubstr("no such file"), HasSubstr("does not exist")))
                << line;
        }
        EXPECT_GE(examples, 2);
    }
}

// --- errors ---

TEST_F(RunErrors, BadWords_AreRefusedByName) {
    expect_refused({"rendr", "scene.pbrt"}, {"unknown command \"rendr\"", "did you mean \"render\"?"});
    // The message lists all known commands once, in the order of the help.
    const std::string all =
        "known are render, light, import, denoise, relight, merge, compare, falsecolour, study, lux, glare, "
        "info\n";
    expect_refused({"rendr", "scene.pbrt"}, {all});
    expect_refused({"wholly-other"}, {"unknown command \"wholly-other\"; " + all});
    expect_refused({"render"}, {"SCENE", "lucerna render --help"});
    expect_refused({"render", "scene.pbrt", "--nonsense"}, {"--nonsense", "lucerna render --help"});
    expect_refused({"render", "scene.pbrt", "extra"}, {"extra"});
    expect_refused({"render", "scene.pbrt", "--spp"}, {"--spp"});
    expect_refused({"glare", "scene.pbrt", "--eye", "here"},
                   {"--eye: \"here\"", "expected NAME=X,Y,Z:X,Y,Z"});
    expect_refused({"lux", "scene.pbrt", "--surface", "desk"},
                   {"--surface: \"desk\"", "expected NAME=X,Y,Z:X,Y,Z:X,Y,Z"});
    expect_refused({"light"}, {"lucerna light --help"});
    expect_refused({"light", "forge"}, {"lucerna light --help"});
    expect_refused({"compare", "a.exr"}, {"REFERENCE"});
    expect_refused({"compare", "a.exr", "b.exr", "--mask", "-1"}, {"--mask", "\"-1\"", "from 0 to"});
    expect_refused({"info"}, {"--integrators"});
}

TEST_F(RunErrors, BadNumbers_AreRefusedWithWhatIsAccepted) {
    const std::vector<std::vector<std::string>> lines = {
        {"--spp", "0"},
        {"--spp", "-3"},
        {"--spp", "1.5"},
        {"--spp", "nan"},
        {"--spp", ""},
        {"--seed", "-1"},
        {"--seed", "seven"},
        {"--threads", "0"},
        {"--threads", "9999"},
        {"--exposure", "inf"},
        {"--exposure", "bright"},
        {"--white-balance", "999"},
        {"--white-balance", "nan"},
        {"--resolution", "0x4"},
        {"--resolution", "4"},
        {"--set", "photons"},
        {"--resolution", "9x1e9"},
    };
    for (const auto& words : lines) {
        std::vector<std::string> line{"render", "scene.pbrt"};
        line.insert(line.end(), words.begin(), words.end());
        expect_refused(line, {words[0]});
    }
}

TEST_F(RunErrors, LooksOfAPicture_AreRefusedWithWhatIsAccepted) {
    for (const std::vector<std::string>& command :
         {std::vector<std::string>{"render", "scene.pbrt"}, {"denoise", "a.exr", "-o", "b.exr"}}) {
        const auto expect = [&](std::string option, std::string word, const std::vector<std::string>& parts) {
            std::vector<std::string> line = command;
            line.insert(line.end(), {option, word});
            expect_refused(line, parts);
        };
        expect("--tone", "filmic", {"--tone", "\"filmic\"", "expected neutral or linear"});
        expect("--tone", "", {"--tone", "neutral or linear"});
        for (const char* word : {"warm", "500", "26000", "-3000", "inf", "3000K", ""})
            expect("--white-balance", word, {"--white-balance", word, "1000 to 25000", "kelvins", "off"});
    }
}

TEST_F(RunErrors, InputFiles_MissingFolderEmptyOrGarbage_AreNamed) {
    std::filesystem::create_directory("folder");
    write("empty.exr", "");
    write("garbage.exr", std::string(200, 'x'));
    write("garbage.tm25ray", std::string(200, 'x'));
    write("garbage.pbrt", "this is \x01\x02 no scene");
    expect_refused({"render", "none.pbrt"}, {"none.pbrt", "no such file"});
    expect_refused({"render", "folder"}, {"folder", "is a folder"});
    expect_refused({"render", "garbage.pbrt"}, {"garbage.pbrt:1"});
    expect_refused({"compare", "none.exr", "none.exr"}, {"none.exr", "no such file"});
    expect_refused({"compare", "empty.exr", "empty.exr"}, {"empty.exr", "empty"});
    expect_refused({"compare", "garbage.exr", "garbage.exr"}, {"garbage.exr", "not a readable OpenEXR"});
    expect_refused({"info", "none"}, {"none", "no such file"});
    expect_refused({"info", "garbage.exr"}, {"garbage.exr"});
    expect_refused({"info", "garbage.tm25ray"}, {"garbage.tm25ray"});
    expect_refused({"info", "folder"}, {"folder"});
    expect_refused({"light", "info", "garbage.exr"}, {"garbage.exr"});
    expect_refused({"light", "info", "none.exr"}, {"none.exr", "no such file"});
    expect_refused({"light", "import", "garbage.tm25ray", "-o", "l.exr"}, {"garbage.tm25ray"});
    expect_refused({"light", "import", "none.tm25ray", "-o", "l.exr"}, {"none.tm25ray", "no such file"});
}

TEST_F(RunErrors, Outputs_ThatCannotBeWritten_AreRefusedBeforeWork) {
    std::filesystem::create_directory("folder.exr");
    write("file", "x");
    expect_refused({"render", "scene.pbrt", "-o", "none/a.exr"},
                   {"none/a.exr", "the folder none does not exist"});
    expect_refused({"render", "scene.pbrt", "-o", "file/a.exr"}, {"file/a.exr", "not a folder"});
    expect_refused({"render", "scene.pbrt", "-o", "folder.exr"}, {"folder.exr", "is a folder"});
    expect_refused({"render", "scene.pbrt", "-o", "a.png"}, {"a.png", "must end in .exr"});
    expect_refused({"render", "scene.pbrt", "-o", "a"}, {"must end in .exr"});
    expect_refused({"render", "scene.pbrt", "-o", "/proc/lucerna.exr"},
                   {"/proc/lucerna.exr", "cannot be written"});
    expect_refused({"render", "scene.pbrt", "-o", "a.exr", "--stats", "none/a.json"}, {"none/a.json"});
    expect_refused({"light", "acquire", "-o", "lamp.png"}, {"lamp.png", ".exr"});
    expect_refused({"light", "acquire", "-o", "none/lamp.exr"}, {"none/lamp.exr"});
    expect_refused({"light", "acquire"}, {"--output"});
}

TEST_F(RunErrors, SceneSettings_Unknown_AreRefusedByName) {
    expect_refused({"render", "scene.pbrt", "--set", "maxdeph=3"}, {"maxdeph", "did you mean \"maxdepth\""});
    expect_refused({"render", "scene.pbrt", "--set", "maxdepth=-1"}, {"maxdepth", "-1"});
    expect_refused({"render", "scene.pbrt", "--set", "maxdepth=nan"}, {"maxdepth"});
    expect_refused({"render", "scene.pbrt", "--integrator", "magic"}, {"magic", "photonmap"});
    expect_refused({"render", "scene.pbrt", "--integrator", "photonmap", "--set", "kernel=round"},
                   {"kernel", "round", "epanechnikov"});
}

TEST_F(RunErrors, Emitters_ThatMakeNoSense_AreRefused) {
    const auto acquire = [&](std::vector<std::string> words, const std::vector<std::string>& named) {
        words.insert(words.begin(), {"light", "acquire", "-o", "l.exr"});
        expect_refused(words, named);
    };
    acquire({"--radius", "40"}, {"--radius", "40mm"});
    acquire({"--radius", "0mm"}, {"--radius"});
    acquire({"--emitter", "star"}, {"--emitter", "star", "disc or rectangle"});
    acquire({"--emitter", "rectangle", "--radius", "4mm"}, {"--radius"});
    acquire({"--size", "4mmx4mm"}, {"--size"});
    acquire({"--unit", "cd"}, {"--unit", "lm or W"});
    acquire({"--flux", "0"}, {"--flux"});
    acquire({"--exponent", "0.5"}, {"--exponent"});
    acquire({"--views", "3x9"}, {"--views", "4"});
    acquire({"--capture", "120%"}, {"--capture"});
    acquire({"--colour", "0,0,0"}, {"--colour"});
    acquire({"--setback", "-1mm"}, {"--setback"});
    acquire({"--views", "4096x4096", "--pixels", "4096x4096"}, {});
}

// A stream whose sink fails.
class BrokenBuffer : public std::streambuf {
  public:
    explicit BrokenBuffer(bool throws) : throws_(throws) {}

  private:
    int_type overflow(int_type /*c*/) override {
        if (throws_) throw std::logic_error("a broken invariant");
        return traits_type::eof();
    }
    bool throws_;
};

TEST_F(RunErrors, OutputThatIsFull_IsNoSuccess) {
    BrokenBuffer full(false);
    std::ostream out(&full);
    std::ostringstream err;
    const char* argv[] = {"lucerna", "info", "scene.pbrt"};
    EXPECT_EQ(run(3, argv, out, err), 1);
    EXPECT_EQ(err.str(), "lucerna: standard output: cannot be written\n");
}

TEST_F(RunErrors, FaultOfOurs_ExitsTwoAndAsksForAReport) {
    BrokenBuffer broken(true);
    std::ostream out(&broken);
    out.exceptions(std::ios::badbit);
    std::ostringstream err;
    const char* argv[] = {"lucerna", "info", "scene.pbrt"};
    EXPECT_EQ(run(3, argv, out, err), 2);
    EXPECT_THAT(err.str(), HasSubstr("please report it"));
    EXPECT_THAT(err.str(), HasSubstr("a broken invariant"));
}

}  // namespace run_test
}  // namespace lucerna
