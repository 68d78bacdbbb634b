// Runs the whole command: what each subcommand writes and prints.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <csignal>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/base/version.h"
#include "engine/cli/run.h"
#include "engine/image/image.h"
#include "engine/system/files.h"
#include "lights/light_field.h"
#include "tests/cli/run_support.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace commands_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

using RunRender = testing::RunTest;
using RunLight = testing::RunTest;
using RunCompare = testing::RunTest;
using RunInfo = testing::RunTest;

// --- render ---

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

TEST_F(RunRender, Unit_IsThatOfTheCommandLineBeforeTheScenes_AndSaidEverywhere) {
    write("lit.pbrt", std::string("Option \"string unit\" \"radiometric\"\n") + testing::kScene);
    const auto render = [](const std::string& scene, std::vector<std::string> more) {
        std::vector<std::string> words{"render", scene, "-o", "u.exr", "--png", "--stats", "u.json"};
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return outcome.out;
    };
    const std::string plain = render("scene.pbrt", {});
    EXPECT_THAT(plain, AllOf(HasSubstr(", W/(m^2 sr), "), HasSubstr(" W/(m^2 sr) is white")));
    const Image before = read_exr("u.exr");
    for (const char* scene : {"scene.pbrt", "lit.pbrt"}) {
        const std::string said = render(scene, {"--unit", "photometric"});
        EXPECT_THAT(said, AllOf(HasSubstr(", cd/m^2, "), HasSubstr(" cd/m^2 is white")));
        const Image image = read_exr("u.exr");
        EXPECT_EQ(image.attributes.at("lucerna.unit"), "cd/m^2");
        EXPECT_EQ(image.data, before.data) << "rgb needs no conversion";
        const auto stats = nlohmann::json::parse(read_text("u.json"));
        EXPECT_EQ(stats["notes"]["unit"], "cd/m^2");
        EXPECT_EQ(stats["notes"]["energy.unit"], "lm");
        EXPECT_THAT(lucerna_run({"info", scene, "--unit", "photometric"}).out,
                    AllOf(HasSubstr("unit         cd/m^2, as stated"), HasSubstr(" lm in all")));
    }
    EXPECT_THAT(lucerna_run({"info", "lit.pbrt"}).out, HasSubstr("unit         W/(m^2 sr), as stated"));
    EXPECT_THAT(lucerna_run({"info", "scene.pbrt"}).out, HasSubstr("unit         W/(m^2 sr)\n"));
    std::filesystem::remove("lit.pbrt");
    expect_refused({"render", "scene.pbrt", "--unit", "lm"},
                   {"--unit: \"lm\" is unknown; expected photometric or radiometric"});
}

TEST_F(RunRender, EveryIntegrator_RendersTheScene) {
    for (const char* name : {"path", "direct", "photonmap", "igi", "progressive"}) {
        std::vector<std::string> words{"render", "scene.pbrt", "-o", "c.exr", "--integrator", name};
        if (std::string_view(name).starts_with("p") && name != std::string("path"))
            words.insert(words.end(), {"--set", "photons=1000"});
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

TEST_F(RunRender, Passes_AreCountedAndSaid) {
    const std::vector<std::string> words{"render",       "scene.pbrt",  "-o",      "a.exr",
                                         "--integrator", "progressive", "--set",   "photons=500",
                                         "--passes",     "5",           "--stats", "a.json"};
    const Outcome outcome = lucerna_run(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, AllOf(HasSubstr("5 passes, 20 spp"), HasSubstr("too few samples to tell")))
        << "a few of 96 pixels make most of the noise";
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_EQ(stats["numbers"]["passes.done"], 5);
    EXPECT_EQ(stats["notes"]["ended_by"], "samples");
    EXPECT_LT(stats["numbers"]["radius.share"], 1);
    EXPECT_EQ(read_exr("a.exr").attributes.at("lucerna.passes"), "5");
}

TEST_F(RunRender, Time_TakesThePlaceOfTheScenesSamples) {
    const Outcome outcome =
        lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--integrator", "progressive", "--set",
                     "photons=500", "--time", "3s", "--show-every", "0.2s", "--png", "--stats", "a.json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_EQ(stats["notes"]["ended_by"], "time");
    EXPECT_TRUE(stats["samples"]["asked"].is_null());
    EXPECT_GT(stats["samples"]["done"], 2) << "more than the scene asks for";
    EXPECT_EQ(stats["complete"], true);
    EXPECT_EQ(files(), (std::vector<std::string>{"a.exr", "a.json", "a.png", "scene.pbrt"}));
}

TEST_F(RunRender, Error_EndsTheRender) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--error", "5%", "--stats", "a.json"}).code,
              0);
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_EQ(stats["notes"]["ended_by"], "error");
    EXPECT_LE(stats["numbers"]["error.denoised"], 0.05);
    EXPECT_GT(stats["numbers"]["error.relative"], stats["numbers"]["error.denoised"])
        << "of the measured image";
}

TEST_F(RunRender, LayersOfAnImage_AreDenoisedLikeTheRender) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--spp", "8", "--layers"}).code, 0);
    const Outcome outcome = lucerna_run({"denoise", "a.exr", "-o", "clean.exr", "--png"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("clean.exr"));
    EXPECT_THAT(outcome.out, HasSubstr("too few samples or pixels to tell its error"));
    const Image both = read_exr("a.exr"), clean = read_exr("clean.exr");
    EXPECT_EQ(files(), (std::vector<std::string>{"a.exr", "clean.exr", "clean.png", "scene.pbrt"}));
    EXPECT_EQ(clean.attributes.count("lucerna.denoised"), 1U);
    const auto channel = [&](const std::string& name) {
        return static_cast<int>(std::ranges::find(both.channels, name) - both.channels.begin());
    };
    double changed = 0;
    for (int y = 0; y < clean.height; ++y) {
        for (int x = 0; x < clean.width; ++x) {
            EXPECT_EQ(clean.value(x, y, 0), both.value(x, y, channel("denoised.R")));
            changed += clean.value(x, y, 0) != both.value(x, y, 0) ? 1 : 0;
        }
    }
    EXPECT_GT(changed, 0) << "R, G and B of the render are as measured";
}

// The options of a picture's look leave the image unchanged.
TEST_F(RunRender, LooksOfAPicture_ChangeItAndLeaveTheImage) {
    const auto render = [](std::vector<std::string> more) {
        std::vector<std::string> words{"render", "scene.pbrt", "-o", "a.exr", "--png", "--spp", "2"};
        words.insert(words.end(), more.begin(), more.end());
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        return std::tuple{outcome.out, read_exr("a.exr").data, read_text("a.png")};
    };
    const auto [said, image, picture] = render({"--exposure", "3"});
    EXPECT_THAT(said, HasSubstr("(exposure +3.00 stops: 0.125 W/(m^2 sr) is white)"));
    const auto [said_warm, image_warm, warm] = render({"--exposure", "3", "--white-balance", "3000"});
    EXPECT_THAT(said_warm, HasSubstr("(exposure +3.00 stops: 0.125 W/(m^2 sr) is white, white of 3000 K)"));
    EXPECT_EQ(image_warm, image);
    EXPECT_NE(warm, picture);
    const auto [said_clipped, image_clipped, clipped] = render({"--exposure", "3", "--tone", "linear"});
    EXPECT_THAT(said_clipped, HasSubstr("(exposure +3.00 stops: 0.125 W/(m^2 sr) is white, clipped)"));
    EXPECT_EQ(image_clipped, image);
    EXPECT_NE(clipped, picture);
    const auto [said_same, image_same, same] =
        render({"--exposure", "3", "--tone", "neutral", "--white-balance", "off"});
    EXPECT_EQ(same, picture);
    EXPECT_EQ(said_same.substr(said_same.find("(exposure")), said.substr(said.find("(exposure")));
}

TEST_F(RunRender, DenoisingWithoutLayers_IsRefusedByWhatIsMissing) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--spp", "2"}).code, 0);
    expect_refused({"denoise", "a.exr", "-o", "b.exr"}, {"a.exr", "first.R", "--layers"});
    expect_refused({"denoise", "a.exr", "-o", "a.exr"}, {"a.exr"});
    expect_refused({"render", "scene.pbrt", "--layers", "--no-denoise"}, {"--no-denoise"});
}

// A picture is denoised by default; an image for other programs, and one with a checkpoint, is not.
TEST_F(RunRender, Denoising_IsForPictures) {
    const auto channels = [](std::vector<std::string> more) {
        std::vector<std::string> words{"render", "scene.pbrt", "-o", "a.exr", "--spp", "2"};
        words.insert(words.end(), more.begin(), more.end());
        EXPECT_EQ(lucerna_run(words).code, 0);
        return read_exr("a.exr").channels.size();
    };
    EXPECT_EQ(channels({}), 6U);
    EXPECT_EQ(channels({"--png"}), 9U);
    EXPECT_EQ(channels({"--denoise"}), 9U);
    EXPECT_EQ(channels({"--png", "--no-denoise"}), 6U);
    EXPECT_EQ(channels({"--png", "--checkpoint", "a.checkpoint"}), 6U);
}

// The reported choice can be given as options: these make the same picture, denoised as for an error.
TEST_F(RunRender, ErrorAlone_ChoosesTheMethodAndSaysWhich) {
    std::string text = read_text("scene.pbrt");
    const std::string limited = "\"integer maxdepth\" 4";
    std::ofstream("scene.pbrt") << text.replace(text.find(limited), limited.size(), "");
    const Outcome outcome =
        lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--error", "5%", "--stats", "a.json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("tried    path "));
    EXPECT_THAT(outcome.out, HasSubstr("from short trials)")) << "the numbers are expectations";
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_THAT(stats["choice"]["tried"].get<std::string>(), HasSubstr("path"));
    EXPECT_EQ(stats["image"]["error"], stats["numbers"]["error.denoised"])
        << "of the picture, whatever its cause";
    EXPECT_LE(stats["image"]["error"], 0.05);
    EXPECT_TRUE(read_exr("a.exr").attributes.contains("lucerna.tried"));

    const std::size_t at = outcome.out.find("method   ");
    ASSERT_NE(at, std::string::npos);
    std::istringstream line(outcome.out.substr(at + 9, outcome.out.find('\n', at) - at - 9));
    std::vector<std::string> words{"render",
                                   "scene.pbrt",
                                   "-o",
                                   "b.exr",
                                   "--denoise",
                                   "--spp",
                                   fmt::format("{}", stats["samples"]["done"].get<int>())};
    for (std::string word; line >> word;) words.push_back(word);
    ASSERT_EQ(lucerna_run(words).code, 0);
    EXPECT_EQ(read_exr("a.exr").data, read_exr("b.exr").data);
}

TEST_F(RunRender, WhoeverNamesTheMethodOrKeepsACheckpoint_HasNothingChosen) {
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--integrator", "path"},
                                                 {"--set", "maxdepth=3"},
                                                 {"--spp", "20"},
                                                 {"--checkpoint", "a.checkpoint"}}) {
        std::vector<std::string> words{"render",  "scene.pbrt", "-o",      "a.exr",
                                       "--error", "20%",        "--stats", "a.json"};
        words.insert(words.end(), more.begin(), more.end());
        ASSERT_EQ(lucerna_run(words).code, 0) << more[0];
        EXPECT_FALSE(nlohmann::json::parse(read_text("a.json")).contains("choice")) << more[0];
    }
    // There is also no choice where only the scene's own method is eligible.
    std::string text = read_text("scene.pbrt");
    const std::string path = "Integrator \"path\" \"integer maxdepth\" 4";
    ASSERT_NE(text.find(path), std::string::npos);
    std::ofstream("scene.pbrt") << text.replace(text.find(path), path.size(), "Integrator \"direct\"");
    EXPECT_THAT(lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--error", "20%"}).out,
                HasSubstr("no other method computes the same"));
}

TEST_F(RunRender, WrongLimits_AreRefused) {
    expect_refused({"render", "scene.pbrt", "--passes", "5"}, {"--passes", "path does not work in passes"});
    expect_refused({"render", "scene.pbrt", "--time", "30"}, {"--time", "\"30\" is not a time"});
    expect_refused({"render", "scene.pbrt", "--error", "0"}, {"--error", "not a share"});
}

TEST_F(RunRender, KeptMaps_GiveTheSameImageAsNewOnes) {
    const auto render = [](const std::string& image, std::vector<std::string> more) {
        std::vector<std::string> words = {"render", "scene.pbrt",   "-o",
                                          image,    "--integrator", "photonmap",
                                          "--set",  "photons=3000", "gatherrays=2"};
        words.insert(words.end(), more.begin(), more.end());
        return lucerna_run(words);
    };
    ASSERT_EQ(render("new.exr", {"--save-maps", "room.photons", "--set", "direct=map"}).code, 0);
    const Outcome again = render("kept.exr", {"--load-maps", "room.photons", "--set", "direct=map"});
    ASSERT_EQ(again.code, 0) << again.err;
    EXPECT_EQ(read_exr("new.exr").data, read_exr("kept.exr").data);

    const Outcome other = render("no.exr", {"--load-maps", "room.photons", "--seed", "1"});
    EXPECT_EQ(other.code, 1);
    EXPECT_THAT(other.err,
                HasSubstr("room.photons: these maps were made for another scene or by other settings: their "
                          "seed is 0, here it is 1"));
    ASSERT_EQ(render("points.exr", {"--save-maps", "room.ply"}).code, 0);
    EXPECT_THAT(read_text("room.ply"), ::testing::StartsWith("ply\nformat binary_"));
    const Outcome path = lucerna_run({"render", "scene.pbrt", "--save-maps", "path.photons"});
    EXPECT_EQ(path.code, 1);
    EXPECT_THAT(path.err, HasSubstr("only photonmap can save and load its maps"));
    EXPECT_FALSE(std::filesystem::exists("no.exr") || std::filesystem::exists("path.photons"));
}

TEST_F(RunRender, Quiet_SaysNothing) {
    const Outcome outcome = lucerna_run({"render", "scene.pbrt", "--quiet", "--png"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.err, "");
}

TEST_F(RunRender, StoppedBeforeTheFirstSample_KeepsTheOldImage) {
    write("a.exr", "the image of yesterday");
    const std::atomic<int> stop{SIGINT};
    const Outcome outcome =
        lucerna_run({"render", "scene.pbrt", "-o", "a.exr", "--stats", "a.json"}, {false, &stop});
    EXPECT_EQ(outcome.code, 128 + SIGINT);
    EXPECT_EQ(outcome.err, "lucerna: stopped: 0 of 2 samples per pixel were done\n");
    EXPECT_THAT(outcome.out, HasSubstr("no image written"));
    EXPECT_EQ(read_text("a.exr"), "the image of yesterday");
    const auto stats = nlohmann::json::parse(read_text("a.json"));
    EXPECT_EQ(stats["complete"], false);
    EXPECT_EQ(stats["samples"]["done"], 0);
}

// --- light ---

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
    std::string scene = testing::kScene;
    scene = scene.substr(0, scene.find("LightSource"));
    write("lamp.pbrt",
          scene +
              "Translate 0 1.5 0\nRotate 90 1 0 0\nLightSource \"lightfield\" \"string filename\" "
              "\"lamp.exr\"\n");
    const Outcome outcome = lucerna_run({"render", "lamp.pbrt", "-o", "a.exr"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out,
                Not(HasSubstr("cell table")));  // made with the lamp, and valid for the field in its file
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

// --- compare ---

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

// --- info ---

TEST_F(RunInfo, Scene_SaysWhatIsInIt) {
    const Outcome outcome = lucerna_run({"info", "scene.pbrt"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const char* word : {"4 triangles", "1 point", "grey", "diffuse", "12 x 8", "2 samples", "path",
                             "maxdepth", "origin", "bounds", "perspective, 40 degrees"}) {
        EXPECT_THAT(outcome.out, HasSubstr(word));
    }
}

TEST_F(RunInfo, Scene_SaysWhatWouldBeBuiltAndWhatWasIgnored) {
    write("odd.pbrt",
          "Integrator \"photonmap\" \"string direct\" \"map\" WorldBegin\n"
          "Material \"mirror\" Shape \"sphere\" \"float radios\" 2 LightSource \"point\"\n");
    const Outcome outcome = lucerna_run({"info", "odd.pbrt"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("direct map built: direct light is read from it"));
    EXPECT_THAT(outcome.out, HasSubstr("caustic map built: the scene has mirrors"));
    EXPECT_THAT(outcome.out, HasSubstr("16 sets of virtual point lights from 64 light paths each"));
    EXPECT_THAT(outcome.out, HasSubstr("\"float radios\" of Shape \"sphere\" has no effect"));
    EXPECT_THAT(lucerna_run({"info", "scene.pbrt"}).out, HasSubstr("ignored      nothing"));
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

}  // namespace commands_test
}  // namespace lucerna
