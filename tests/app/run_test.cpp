// The whole command, as a function: many command lines, and what they leave behind.
#include "engine/app/run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/base/files.h"
#include "engine/base/image.h"
#include "lights/light_field.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

// A floor and a wall under a small lamp: enough for every integrator.
constexpr const char* kScene = R"(
LookAt 0 1 -3  0 0.5 0  0 1 0
Camera "perspective" "float fov" 40
Film "rgb" "integer xresolution" 12 "integer yresolution" 8 "string filename" "folder/picture.exr"
Sampler "independent" "integer pixelsamples" 2
Integrator "path" "integer maxdepth" 4
WorldBegin
MakeNamedMaterial "grey" "string type" "diffuse" "rgb reflectance" [ 0.5 0.5 0.5 ]
NamedMaterial "grey"
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 -2  -2 0 2  2 0 2  2 0 -2 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ] "point3 P" [ -2 0 2  -2 2 2  2 2 2  2 0 2 ]
LightSource "point" "rgb I" [ 3 3 3 ] "point3 from" [ 0 1.5 0 ]
)";

struct Outcome {
    int code;
    std::string out, err;
};

Outcome lucerna_run(const std::vector<std::string>& words, const Surroundings& around = {}) {
    std::vector<const char*> argv{"lucerna"};
    for (const std::string& word : words) argv.push_back(word.c_str());
    std::ostringstream out, err;
    const int code = run(static_cast<int>(argv.size()), argv.data(), out, err, around);
    return {code, out.str(), err.str()};
}

std::vector<std::string> split(const std::string& text) {
    std::istringstream in(text);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    return words;
}

// Runs every test in a folder of its own: outputs without a folder land in the current one.
class Run : public ::testing::Test {
  protected:
    void SetUp() override {
        before_ = std::filesystem::current_path();
        std::filesystem::current_path(folder_.path());
        write("scene.pbrt", kScene);
    }
    void TearDown() override { std::filesystem::current_path(before_); }

    static void write(const std::string& name, const std::string& text) { std::ofstream(name) << text; }

    // Names in the folder, in order.
    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
            names.push_back(std::filesystem::relative(entry.path(), folder_.path()).string());
        }
        std::sort(names.begin(), names.end());
        return names;
    }

    // Exit 1, one line that names what must be named, and nothing written.
    void expect_refused(const std::vector<std::string>& words, const std::vector<std::string>& named) {
        SCOPED_TRACE(::testing::PrintToString(words));
        const std::vector<std::string> before = files();
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
        EXPECT_THAT(outcome.err, StartsWith("lucerna: "));
        for (const std::string& part : named) EXPECT_THAT(outcome.err, HasSubstr(part));
        EXPECT_EQ(files(), before);
    }

    testing::TemporaryFolder folder_;
    std::filesystem::path before_;
};

using RunHelp = Run;
using RunErrors = Run;
using RunRender = Run;
using RunLight = Run;
using RunCompare = Run;
using RunInfo = Run;

// --- help
// ---------------------------------------------------------------------------------------------------------

const std::vector<std::vector<std::string>> kCommands = {
    {},          {"render"}, {"light"}, {"light", "import"}, {"light", "acquire"}, {"light", "info"},
    {"compare"}, {"info"}};

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
    for (const char* name : {"render", "light", "compare", "info"}) EXPECT_THAT(help, HasSubstr(name));
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
    EXPECT_EQ(outcome.out, "lucerna " + std::string(program_version()) + "\n");
}

// Files are missing or the wrong kind, so nothing is made; but no word of an example may be refused.
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
            if (words[0] == "light" && words[1] == "acquire") {  // needs no input: its folder is made to miss
                std::replace(words.begin(), words.end(), std::string("lamp.exr"),
                             std::string("none/lamp.exr"));
            }
            const Outcome outcome = lucerna_run(words);
            if (outcome.code == 0) continue;
            EXPECT_THAT(outcome.err, ::testing::AnyOf(HasSubstr("no such file"), HasSubstr("no folder")))
                << line;
        }
        EXPECT_GE(examples, 2);
    }
}

// --- errors
// -------------------------------------------------------------------------------------------------------

TEST_F(RunErrors, BadWords_AreRefusedByName) {
    expect_refused({"rendr", "scene.pbrt"}, {"unknown command \"rendr\"", "did you mean \"render\"?"});
    expect_refused({"render"}, {"SCENE", "lucerna render --help"});
    expect_refused({"render", "scene.pbrt", "--nonsense"}, {"--nonsense", "lucerna render --help"});
    expect_refused({"render", "scene.pbrt", "extra"}, {"extra"});
    expect_refused({"render", "scene.pbrt", "--spp"}, {"--spp"});
    expect_refused({"light"}, {"lucerna light --help"});
    expect_refused({"light", "forge"}, {"lucerna light --help"});
    expect_refused({"compare", "a.exr"}, {"REFERENCE"});
    expect_refused({"info"}, {"--integrators"});
}

TEST_F(RunErrors, BadNumbers_AreRefusedWithWhatIsAccepted) {
    const std::vector<std::vector<std::string>> lines = {
        {"--spp", "0"},        {"--spp", "-3"},       {"--spp", "1.5"},          {"--spp", "nan"},
        {"--spp", ""},         {"--seed", "-1"},      {"--seed", "seven"},       {"--threads", "0"},
        {"--threads", "9999"}, {"--exposure", "inf"}, {"--exposure", "bright"},  {"--resolution", "0x4"},
        {"--resolution", "4"}, {"--set", "photons"},  {"--resolution", "9x1e9"},
    };
    for (const auto& words : lines) {
        std::vector<std::string> line{"render", "scene.pbrt"};
        line.insert(line.end(), words.begin(), words.end());
        expect_refused(line, {words[0]});
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
    expect_refused({"render", "scene.pbrt", "-o", "none/a.exr"}, {"none/a.exr", "no folder none"});
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

// --- render
// -------------------------------------------------------------------------------------------------------

TEST_F(RunRender, Defaults_WriteTheScenesImageHere) {
    const Outcome outcome = lucerna_run({"render", "scene.pbrt", "--png"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    EXPECT_EQ(files(), (std::vector<std::string>{"picture.exr", "picture.png", "scene.pbrt"}));
    EXPECT_THAT(outcome.out, HasSubstr("picture.exr"));
    EXPECT_THAT(outcome.out, HasSubstr("picture.png"));
    const Image image = read_exr("picture.exr");
    EXPECT_EQ(image.width, 12);
    EXPECT_EQ(image.height, 8);
    EXPECT_EQ(image.attributes.at("lucerna.scene"), "scene.pbrt");
    EXPECT_EQ(image.attributes.at("lucerna.integrator"), "path");
    EXPECT_EQ(image.attributes.at("lucerna.maxdepth"), "4");
    EXPECT_EQ(image.attributes.at("lucerna.seed"), "0");
    EXPECT_EQ(image.attributes.at("lucerna.spp"), "2");
    EXPECT_EQ(image.attributes.at("lucerna.version"), program_version());
    EXPECT_TRUE(image.attributes.contains("lucerna.seconds"));
}

TEST_F(RunRender, CommandLine_OverridesTheScene) {
    const Outcome outcome =
        lucerna_run({"render",    "scene.pbrt", "-o",           "b.exr",     "--integrator",
                     "photonmap", "--set",      "photons=2000", "--set",     "gatherrays=2",
                     "--spp",     "3",          "--seed",       "9",         "--resolution",
                     "6x5",       "--stats",    "b.json",       "--threads", "2"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Image image = read_exr("b.exr");
    EXPECT_EQ(image.width, 6);
    EXPECT_EQ(image.height, 5);
    EXPECT_EQ(image.attributes.at("lucerna.photons"), "2000");

    const auto stats = nlohmann::json::parse(read_text("b.json"));
    for (const char* key :
         {"program", "version", "scene", "integrator", "settings", "seed", "threads", "image", "samples",
          "complete", "seconds", "numbers", "notes", "warnings", "peak_memory_bytes"}) {
        EXPECT_TRUE(stats.contains(key)) << key;
    }
    EXPECT_EQ(stats["integrator"], "photonmap");
    EXPECT_EQ(stats["settings"]["photons"], 2000);
    EXPECT_EQ(stats["settings"]["kernel"], "epanechnikov");
    EXPECT_EQ(stats["seed"], 9);
    EXPECT_EQ(stats["threads"], 2);
    EXPECT_EQ(stats["samples"]["asked"], 3);
    EXPECT_EQ(stats["samples"]["done"], 3);
    EXPECT_EQ(stats["image"]["width"], 6);
    EXPECT_EQ(stats["complete"], true);
    EXPECT_GT(stats["seconds"]["total"], 0);
    EXPECT_GT(stats["peak_memory_bytes"], 1'000'000);
}

TEST_F(RunRender, EveryIntegrator_RendersTheScene) {
    for (const char* name : {"path", "direct", "photonmap", "igi"}) {
        std::vector<std::string> words{"render", "scene.pbrt", "-o", "c.exr", "--integrator", name};
        if (name == std::string("photonmap")) words.insert(words.end(), {"--set", "photons=1000"});
        EXPECT_EQ(lucerna_run(words).code, 0) << name;
        const Image image = read_exr("c.exr");
        EXPECT_TRUE(std::any_of(image.data.begin(), image.data.end(), [](float v) { return v > 0; })) << name;
    }
}

TEST_F(RunRender, SameSeed_SameImageForAnyThreads) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--threads", "1"}).code, 0);
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "b.exr", "--threads", "3"}).code, 0);
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "c.exr", "--seed", "1"}).code, 0);
    EXPECT_EQ(read_exr("a.exr").data, read_exr("b.exr").data);
    EXPECT_NE(read_exr("a.exr").data, read_exr("c.exr").data);
}

TEST_F(RunRender, Quiet_SaysNothing) {
    const Outcome outcome = lucerna_run({"render", "scene.pbrt", "--quiet", "--png"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.err, "");
}

TEST_F(RunRender, StoppedBeforeTheFirstSample_KeepsTheOldImage) {
    write("a.exr", "the image of yesterday");
    const std::atomic<bool> stop{true};
    const Outcome outcome =
        lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--stats", "a.json"}, {false, &stop});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.out, HasSubstr("stopped: 0 of 2 samples per pixel were done"));
    EXPECT_THAT(outcome.out, HasSubstr("no image written"));
    EXPECT_EQ(read_text("a.exr"), "the image of yesterday");
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_EQ(stats["complete"], false);
    EXPECT_EQ(stats["samples"]["done"], 0);
}

// --- light
// --------------------------------------------------------------------------------------------------------

const std::vector<std::string> kSmallLamp = {"light",   "acquire", "-o",       "lamp.exr", "--radius",
                                             "10mm",    "--flux",  "7",        "--unit",   "W",
                                             "--views", "5x6",     "--pixels", "8x10",     "--quiet"};

TEST_F(RunLight, Acquire_HoldsTheFluxItWasGiven) {
    const Outcome outcome = lucerna_run(kSmallLamp);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(files(), (std::vector<std::string>{"lamp.cells", "lamp.exr", "scene.pbrt"}));
    const LightField field = read_light_field("lamp.exr");
    EXPECT_EQ(field.rig().views, V2i(5, 6));
    EXPECT_EQ(field.rig().pixels, V2i(8, 10));
    EXPECT_EQ(field.info().unit, FluxUnit::watt);
    EXPECT_NEAR(field.info().captured + field.info().missed, 7, 0.01);
    EXPECT_GT(field.info().captured, 0.98 * 7 * 0.98);
    EXPECT_THAT(field.info().provenance, HasSubstr("disc"));
}

TEST_F(RunLight, Info_SaysGeometryAndFlux) {
    ASSERT_EQ(lucerna_run(kSmallLamp).code, 0);
    const std::string light = lucerna_run({"light", "info", "lamp.exr"}).out;
    for (const char* word : {"5 x 6 views", "8 x 10 pixels", "captured", "negative", "peak", " W"}) {
        EXPECT_THAT(light, HasSubstr(word));
    }
    EXPECT_THAT(lucerna_run({"info", "lamp.exr"}).out, HasSubstr("a light field"));
}

TEST_F(RunLight, AcquiredLamp_LightsAScene) {
    ASSERT_EQ(lucerna_run(kSmallLamp).code, 0);
    std::string scene = kScene;
    scene = scene.substr(0, scene.find("LightSource"));
    write("lamp.pbrt",
          scene +
              "Translate 0 1.5 0\nRotate 90 1 0 0\nLightSource \"lightfield\" \"string filename\" "
              "\"lamp.exr\"\n");
    const Outcome outcome = lucerna_run({"render", "lamp.pbrt", "-o", "a.exr"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out,
                Not(HasSubstr("cell table")));  // made with the lamp, and of the field in its file
    const Image image = read_exr("a.exr");
    EXPECT_TRUE(std::any_of(image.data.begin(), image.data.end(), [](float v) { return v > 0; }));
    EXPECT_THAT(lucerna_run({"info", "lamp.pbrt"}).out, HasSubstr("lightfield"));
}

TEST_F(RunLight, Import_AccountsForAllFlux) {
    LUCERNA_NEED_DATA(path, "osram-ostar-green-100k.tm25ray");
    const std::string file = std::filesystem::absolute(path).string();
    const Outcome outcome =
        lucerna_run({"light", "import", file, "-o", "green.exr", "--views", "10x10", "--pixels", "16x16"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const LightField field = read_light_field("green.exr");
    EXPECT_EQ(field.rig().views, V2i(10, 10));
    EXPECT_NEAR(field.info().captured + field.info().missed, 337, 0.5);
    EXPECT_GT(field.info().captured, 0.95 * 337);
    EXPECT_THAT(outcome.out, HasSubstr("beside M"));
    EXPECT_THAT(lucerna_run({"info", file}).out, HasSubstr("100000"));
}

// --- compare
// ------------------------------------------------------------------------------------------------------

TEST_F(RunCompare, TwoImages_TextAndJsonAgree) {
    Image a = Image::rgb(2, 1);
    a.data = {1, 1, 1, 5, 5, 5};
    Image b = Image::rgb(2, 1);
    b.data = {2, 2, 2, 3, 3, 3};
    write_exr("a.exr", a);
    write_exr("b.exr", b);
    const Outcome text = lucerna_run({"compare", "a.exr", "b.exr", "--json", "c.json"});
    ASSERT_EQ(text.code, 0) << text.err;
    EXPECT_THAT(text.out, HasSubstr("MSE            2.5\n"));
    EXPECT_THAT(text.out, HasSubstr("(t-r)^2/(r^2+0.0001)"));
    EXPECT_THAT(text.out, HasSubstr("ratio 1.2\n"));
    const auto json = nlohmann::json::parse(read_text("c.json"));
    EXPECT_EQ(json["mse"], 2.5);
    EXPECT_EQ(json["channels"]["R"]["ratio"], 1.2);
    EXPECT_EQ(json["bad_pixels"], 0);
    EXPECT_FALSE(json.contains("z_test"));
    const Outcome printed = lucerna_run({"compare", "a.exr", "b.exr", "--json", "-"});
    EXPECT_EQ(nlohmann::json::parse(printed.out), json);
}

TEST_F(RunCompare, NotFinite_IsReported) {
    Image a = Image::rgb(2, 1);
    a.data = {NAN, 1, 1, 1, 1, 1};
    Image b = Image::rgb(2, 1);
    b.data = {1, 1, 1, 1, 1, 1};
    write_exr("a.exr", a);
    write_exr("b.exr", b);
    EXPECT_THAT(lucerna_run({"compare", "a.exr", "b.exr"}).out, HasSubstr("not finite: 1 in the image"));
    EXPECT_THAT(lucerna_run({"info", "a.exr"}).out, HasSubstr("NOT FINITE: 1 pixel"));
}

TEST_F(RunCompare, DifferentSizes_IsRefused) {
    write_exr("a.exr", Image::rgb(2, 1));
    write_exr("b.exr", Image::rgb(1, 2));
    expect_refused({"compare", "a.exr", "b.exr"}, {"a.exr", "2 x 1", "b.exr", "1 x 2"});
}

TEST_F(RunCompare, TwoRenders_CarryAZTest) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--spp", "8"}).code, 0);
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "b.exr", "--spp", "8", "--seed", "1"}).code, 0);
    EXPECT_THAT(lucerna_run({"compare", "a.exr", "b.exr"}).out, HasSubstr("z-test"));
}

// --- info
// ---------------------------------------------------------------------------------------------------------

TEST_F(RunInfo, Scene_SaysWhatIsInIt) {
    const Outcome outcome = lucerna_run({"info", "scene.pbrt"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const char* word : {"4 triangles", "1 point", "grey", "diffuse", "12 x 8", "2 samples", "path",
                             "maxdepth", "origin", "bounds", "perspective, 40 degrees"}) {
        EXPECT_THAT(outcome.out, HasSubstr(word));
    }
}

TEST_F(RunInfo, Integrators_ListEveryParameter) {
    const Outcome outcome = lucerna_run({"info", "--integrators"});
    EXPECT_EQ(outcome.code, 0);
    for (const char* word : {"path:", "direct:", "photonmap:", "igi:", "gatherrays", "mindist", "maxdepth",
                             "constant | cone | epanechnikov"}) {
        EXPECT_THAT(outcome.out, HasSubstr(word));
    }
}

TEST_F(RunInfo, Image_SaysChannelsAndHeader) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr"}).code, 0);
    const std::string text = lucerna_run({"info", "a.exr"}).out;
    for (const char* word : {"12 x 8", "variance.R", "mean", "lucerna.integrator", "lucerna.spp"}) {
        EXPECT_THAT(text, HasSubstr(word));
    }
}

}  // namespace
}  // namespace lucerna
