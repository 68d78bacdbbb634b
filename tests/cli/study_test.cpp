// `lucerna study`: its input, the results that it keeps, and its output.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <csignal>

#include <atomic>
#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "engine/cli/command_files.h"
#include "engine/evaluation/study.h"
#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace study_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::lucerna_run;
using ::testing::Not;
using testing::Outcome;

constexpr const char* kStudy = R"(title = "Two ways"
seeds = 2
[[scene]]
file = "scene.pbrt"
resolution = "8x6"
[reference]
integrator = "path"
spp = [16]
[[method]]
name = "paths"
integrator = "path"
set = "maxdepth=3|4"
spp = [1, 4]
[[method]]
name = "photons"
integrator = "photonmap"
set = "photons=500 gatherrays=1"
spp = [2]
)";

class RunStudy : public testing::RunTest {
  protected:
    static void write_study(const std::string& text) { write_text("study.toml", text); }
    static std::string with(std::string text, const std::string& old, const std::string& now) {
        return text.replace(text.find(old), old.size(), now);
    }
    static std::string refusal(const std::string& text) {
        write_study(text);
        const Outcome outcome = lucerna_run({"study", "study.toml", "-o", "out"});
        EXPECT_NE(outcome.code, 0);
        EXPECT_FALSE(std::filesystem::exists("out/results.csv"));
        return outcome.err;
    }
};

TEST_F(RunStudy, Description_HasEveryChoice) {
    write_study(kStudy);
    const StudyDescription read = read_study("study.toml");
    EXPECT_EQ(read.title, "Two ways");
    EXPECT_EQ(read.seeds, 2);
    ASSERT_EQ(read.scenes.size(), 1U);
    EXPECT_EQ(read.scenes[0].name, "scene");
    EXPECT_EQ(read.scenes[0].resolution, V2i(8, 6));
    EXPECT_EQ(read.reference.settings, "spp=16");
    std::vector<std::string> settings;
    for (const StudyPoint& point : read.points) settings.push_back(point.method + ": " + point.settings);
    EXPECT_THAT(settings,
                ElementsAre("paths: maxdepth=3 spp=1", "paths: maxdepth=3 spp=4", "paths: maxdepth=4 spp=1",
                            "paths: maxdepth=4 spp=4", "photons: photons=500 gatherrays=1 spp=2"));
}

TEST_F(RunStudy, SecondTime_FindsEveryRenderAndSaysTheSame) {
    write_study(kStudy);
    const Outcome first = lucerna_run({"study", "study.toml", "-o", "out"});
    ASSERT_EQ(first.code, 0) << first.err;
    EXPECT_THAT(first.out, HasSubstr("renders  11 made, 0 found"));
    const std::string csv = read_text("out/results.csv"), json = read_text("out/results.json");

    const Outcome second = lucerna_run({"study", "study.toml", "-o", "out"});
    ASSERT_EQ(second.code, 0) << second.err;
    EXPECT_THAT(second.out, HasSubstr("renders  0 made, 11 found"));
    EXPECT_EQ(read_text("out/results.csv"), csv);
    EXPECT_EQ(read_text("out/results.json"), json);

    const auto results = nlohmann::json::parse(json);
    EXPECT_EQ(results["points"].size(), 5U);
    for (const auto& point : results["points"]) {
        EXPECT_GT(point["seconds"], 0);
        EXPECT_GT(point["error2"], 0);
        EXPECT_GT(point["noise2"]["value"], 0);
    }
    const auto noise2 = [&](int i) { return results["points"][i]["noise2"]["value"].get<double>(); };
    EXPECT_LT(noise2(1), 0.5 * noise2(0)) << "four samples against one";
}

TEST_F(RunStudy, Page_IsWrittenAndQuietSaysNothing) {
    write_study(kStudy);
    const Outcome outcome =
        lucerna_run({"study", "study.toml", "-o", "out dir", "--quiet", "--threads", "1"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::string page = read_text("out dir/study.html");
    EXPECT_THAT(page, HasSubstr("<h1>Two ways</h1>"));
    EXPECT_THAT(page, HasSubstr("lucerna study study.toml -o &#39;out dir&#39; --threads 1"));
    EXPECT_THAT(page, HasSubstr("set = &quot;maxdepth=3|4&quot;"));

    const auto results = nlohmann::json::parse(read_text("out dir/results.json"));
    EXPECT_EQ(results["threads"], nlohmann::json({1}));
    ASSERT_EQ(results["machines"].size(), 1U);
    EXPECT_THAT(results["machines"][0].get<std::string>(), HasSubstr("processor"));
    ASSERT_GE(results["dates"].size(), 1U);
    EXPECT_TRUE(
        std::regex_match(results["dates"][0].get<std::string>(), std::regex("20\\d\\d-\\d\\d-\\d\\d")));
}

// A render with another number of threads is reused, but the page marks its time as not comparable.
TEST_F(RunStudy, OtherThreads_AreToldOnThePage) {
    write_study(kStudy);
    ASSERT_EQ(lucerna_run({"study", "study.toml", "-o", "out", "--threads", "1"}).code, 0);
    EXPECT_THAT(read_text("out/study.html"), Not(HasSubstr("times cannot be compared")));
    write_study(with(kStudy, "spp = [2]", "spp = [2, 3]"));
    ASSERT_EQ(lucerna_run({"study", "study.toml", "-o", "out", "--threads", "2"}).code, 0);
    EXPECT_THAT(read_text("out/study.html"), HasSubstr("times cannot be compared"));
}

// After an interruption the page shows the renders that exist.
TEST_F(RunStudy, Stopped_ShowsWhatThereIs) {
    write_study(kStudy);
    ASSERT_EQ(lucerna_run({"study", "study.toml", "-o", "out"}).code, 0);
    std::filesystem::remove("out/study.html");
    const std::atomic<int> stop{SIGINT};
    write_study(with(kStudy, "spp = [2]", "spp = [2, 3]"));
    const Outcome some = lucerna_run({"study", "study.toml", "-o", "out"}, {false, &stop});
    EXPECT_EQ(some.code, 128 + SIGINT) << some.err;
    EXPECT_THAT(some.err, HasSubstr("stopped: 5 of 6 points are measured"));
    EXPECT_TRUE(std::filesystem::exists("out/study.html"));

    write_study(with(kStudy, "seeds = 2", "seeds = 3"));
    const Outcome none = lucerna_run({"study", "study.toml", "-o", "out"}, {false, &stop});
    EXPECT_EQ(none.code, 128 + SIGINT) << none.err;
    EXPECT_THAT(none.err, HasSubstr("stopped: 0 of 5 points"));
}

// --strict refuses departures that the scene reader otherwise replaces with a warning, even if the renders
// already exist.
TEST_F(RunStudy, StrictWithADepartureInAScene_IsRefused) {
    write_study(kStudy);
    const std::vector<std::string> lenient = {"study", "study.toml", "-o", "out"};
    std::vector<std::string> strict = lenient;
    strict.emplace_back("--strict");
    const Outcome clean = lucerna_run(strict);
    ASSERT_EQ(clean.code, 0) << clean.err;
    EXPECT_THAT(read_text("out/study.html"), HasSubstr("lucerna study study.toml -o out --strict"));

    write("scene.pbrt", std::string(testing::kScene) + "Material \"velvet\"\n");
    const Outcome warned = lucerna_run(lenient);
    EXPECT_EQ(warned.code, 0) << warned.err;
    EXPECT_THAT(warned.err, HasSubstr("velvet"));
    expect_refused(strict, {"scene.pbrt:13:", "velvet"});
}

TEST_F(RunStudy, NotesOfAnotherKind_AreRefused) {
    write_study(kStudy);
    ASSERT_EQ(lucerna_run({"study", "study.toml", "-o", "out"}).code, 0);
    for (const auto& file : std::filesystem::directory_iterator("out/runs")) {
        if (file.path().extension() == ".json")
            write_text(file.path(), "{\"seconds\": {\"total\": \"long\"}}");
    }
    const Outcome outcome = lucerna_run({"study", "study.toml", "-o", "out"});
    EXPECT_EQ(outcome.code, 1);
    EXPECT_THAT(outcome.err, HasSubstr("remove it to have it rendered again"));
}

// After a half-written image, a lost render or a changed setting, exactly the missing renders are made.
TEST_F(RunStudy, WhatIsMissingOrNew_IsMade) {
    write_study(kStudy);
    ASSERT_EQ(lucerna_run({"study", "study.toml", "-o", "out"}).code, 0);
    const std::string csv = read_text("out/results.csv");
    for (const auto& file : std::filesystem::directory_iterator("out/runs")) {
        if (file.path().extension() != ".json") continue;
        std::filesystem::remove(file.path());  // as if killed between the image and its notes
        break;
    }
    EXPECT_THAT(lucerna_run({"study", "study.toml", "-o", "out"}).out, HasSubstr("1 made, 10 found"));

    write_study(with(kStudy, "spp = [2]", "spp = [2, 3]"));
    EXPECT_THAT(lucerna_run({"study", "study.toml", "-o", "out"}).out, HasSubstr("2 made, 11 found"));

    // The scene itself changes.
    write_text("scene.pbrt", read_text("scene.pbrt") + "\n# another thought\n");
    write_study(kStudy);
    EXPECT_THAT(lucerna_run({"study", "study.toml", "-o", "out"}).out, HasSubstr("0 made, 11 found"));
    write_text("scene.pbrt", read_text("scene.pbrt") + "LightSource \"point\"\n");
    EXPECT_THAT(lucerna_run({"study", "study.toml", "-o", "out"}).out, HasSubstr("11 made, 0 found"));
}

TEST_F(RunStudy, WrongDescriptions_AreRefusedBeforeTheWorkByPlace) {
    EXPECT_THAT(refusal(with(kStudy, "photons=500", "fotons=500")),
                AllOf(HasSubstr("study.toml:17"), HasSubstr("did you mean \"photons\"")));
    EXPECT_THAT(refusal(with(kStudy, "photons=500", "photons=many")), HasSubstr("study.toml:17"));
    EXPECT_THAT(refusal(with(kStudy, "integrator = \"photonmap\"", "integrator = \"fotonmap\"")),
                HasSubstr("photonmap"));
    EXPECT_THAT(refusal(with(kStudy, "spp = [16]", "spp = [16, 32]")),
                HasSubstr("2 combinations of settings"));
    EXPECT_THAT(refusal(with(kStudy, "spp = [16]", "spp = [1.5]")), HasSubstr("1.5"));
    EXPECT_THAT(refusal(with(kStudy, "spp = [16]", "spp = []")), HasSubstr("one or more"));
    EXPECT_THAT(refusal(with(kStudy, "spp = [16]", "spp = 16")),
                AllOf(HasSubstr("study.toml:8"), HasSubstr("\"spp\" is a whole number"), HasSubstr("list")));
    EXPECT_THAT(refusal(with(kStudy, "spp = [16]", "spp = [\"16\"]")),
                AllOf(HasSubstr("study.toml:8"), HasSubstr("\"spp\" is text; expected a number")));
    EXPECT_THAT(refusal(with(kStudy, "spp = [2]", "")),
                AllOf(HasSubstr("study.toml:14"), HasSubstr("time = [\"5s\"]")));
    EXPECT_THAT(
        refusal(with(kStudy, "spp = [2]", "time = [\"5\"]")),
        AllOf(HasSubstr("study.toml:18"), HasSubstr("\"5\" is not a time"), HasSubstr("(key \"time\")")));
    EXPECT_THAT(refusal(with(kStudy, "spp = [2]", "time = [-1]")),
                AllOf(HasSubstr("study.toml:18"), HasSubstr("\"time\" of -1")));
    EXPECT_THAT(refusal(with(kStudy, "spp = [2]", "time = [true]")),
                AllOf(HasSubstr("study.toml:18"), HasSubstr("\"time\" has true or false; expected times")));
    EXPECT_THAT(refusal(with(kStudy, "[reference]", "mask_lamps = 1\n[reference]")),
                AllOf(HasSubstr("study.toml:6"), HasSubstr("\"mask_lamps\" is a whole number")));
    EXPECT_THAT(refusal(with(kStudy, "[reference]", "mask_lamp = true\n[reference]")),
                AllOf(HasSubstr("study.toml:6"), HasSubstr("did you mean \"mask_lamps\"?")));
    EXPECT_THAT(refusal(with(kStudy, "seeds = 2", "seeds = 0")), HasSubstr("study.toml:2"));
    EXPECT_THAT(refusal(with(kStudy, "[[scene]]\nfile = \"scene.pbrt\"\nresolution = \"8x6\"\n", "")),
                HasSubstr("no [[scene]]"));
    EXPECT_THAT(refusal(with(kStudy, "scene.pbrt", "gone.pbrt")),
                AllOf(HasSubstr("study.toml:4"), HasSubstr("gone.pbrt"), HasSubstr("is no file")));
    EXPECT_THAT(
        refusal(with(kStudy, "8x6", "8by6")),
        AllOf(HasSubstr("study.toml:5"), HasSubstr("\"8by6\" is not a size"), HasSubstr("\"resolution\"")));
    EXPECT_THAT(refusal(with(kStudy, "title", "titel")), HasSubstr("titel"));
    EXPECT_THAT(refusal(with(kStudy, "maxdepth=3|4", "maxdepth=3|3")), HasSubstr("maxdepth=3 spp=1"));
}

// The last of two scenes has a fault, so the first is not rendered either.
TEST_F(RunStudy, FaultInALaterScene_IsFoundBeforeAnyRender) {
    write("other.pbrt", std::string(testing::kScene) + "Shape \"sphere\" \"float radius\" oops\n");
    const std::string said =
        refusal(with(kStudy, "[reference]", "[[scene]]\nfile = \"other.pbrt\"\n[reference]"));
    EXPECT_THAT(said, HasSubstr("study.toml:7:"));
    EXPECT_THAT(said, HasSubstr("\"file\": other.pbrt:13:"));
    EXPECT_THAT(said, HasSubstr("oops"));
    EXPECT_TRUE(std::filesystem::is_empty("out/runs"));
}

TEST_F(RunStudy, Times_EndRendersAndAreFoundAgain) {
    const std::string timed = with(kStudy, "spp = [1, 4]", "time = [\"300ms\", 0.6]");
    EXPECT_THAT(refusal(timed), HasSubstr("\"300ms\" is not a time"));
    write_study(with(kStudy, "spp = [1, 4]", "time = [\"0.3s\", 0.6]"));
    const StudyDescription read = read_study("study.toml");
    EXPECT_EQ(read.points[0].settings, "maxdepth=3 time=0.3s");
    EXPECT_EQ(read.points[1].settings, "maxdepth=3 time=0.6s");
    EXPECT_EQ(read.points[0].overrides.spp, 0);
    EXPECT_DOUBLE_EQ(read.points[1].seconds, 0.6);
    const Outcome outcome = lucerna_run({"study", "study.toml", "-o", "out"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto results = nlohmann::json::parse(read_text("out/results.json"));
    ASSERT_EQ(results["points"].size(), 5U);
    const auto seconds = [&](int i) { return results["points"][i]["seconds"].get<double>(); };
    EXPECT_GT(seconds(0), 0.2);
    EXPECT_GT(seconds(1), 0.5);
    EXPECT_LT(seconds(0), seconds(1));
    EXPECT_THAT(lucerna_run({"study", "study.toml", "-o", "out"}).out, HasSubstr("0 made, 11 found"));
}

// A bright lamp covers a few pixels.
TEST_F(RunStudy, MaskOfLamps_LeavesOutPixelsThatSeeOne) {
    write("scene.pbrt", std::string(testing::kScene) + R"(AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1000 1000 1000 ]
Translate 0 0.6 0
Shape "sphere" "float radius" 0.3
AttributeEnd
)");
    const auto mean_errors = [](const std::string& text) {
        write_study(text);
        const Outcome outcome = lucerna_run({"study", "study.toml", "-o", "out"});
        EXPECT_EQ(outcome.code, 0) << outcome.err;
        const auto results = nlohmann::json::parse(read_text("out/results.json"));
        return std::pair(results["points"][0]["error2"].get<double>(),
                         results["points"][0]["flip"].get<double>());
    };
    const auto [with_lamp, flip_with] = mean_errors(kStudy);
    const auto [without, flip_without] =
        mean_errors(with(kStudy, "[reference]", "mask_lamps = true\n[reference]"));
    // Relative to a tenth of the mean, which the lamp makes large, all other differences are small.
    EXPECT_NE(with_lamp, without);
    EXPECT_NE(flip_with, flip_without);
    StudyScene scene;
    std::size_t masked = 0, all = 0;
    for (const auto& file : std::filesystem::directory_iterator("out/runs")) {
        if (file.path().extension() != ".exr") continue;
        const Image image = read_exr(file.path());
        const auto lamps = find_channel(image, std::string(kLampChannels[0]));
        if (!lamps) continue;
        scene.mask_lamps = true;
        const Image reference = read_reference(file.path(), scene).image;
        EXPECT_FALSE(find_channel(reference, std::string(kLampChannels[0])));
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x, ++all) {
                const bool sees = image.value(x, y, static_cast<int>(*lamps)) > 0;
                EXPECT_EQ(std::isnan(reference.value(x, y, 0)), sees);
                // The lamp is brighter than everything that it lights, so bright pixels are exactly those
                // that see it.
                EXPECT_TRUE(sees || !(image.rgb_at(x, y).x > 200)) << x << " " << y;
                masked += sees ? 1 : 0;
            }
        }
    }
    EXPECT_GT(masked, 0U);
    EXPECT_LT(masked, all / 2);
}

StudyResult point(const char* scene, const char* method, double seconds, double error) {
    StudyResult result;
    result.scene = scene;
    result.method = method;
    result.settings = "spp=1";
    result.seconds = seconds;
    result.error2 = error * error;
    return result;
}

TEST(StudyTrade, Best_IsWhatNothingBeatsInBoth) {
    std::vector<StudyResult> results = {point("a", "fast", 1, 0.3),   point("a", "good", 9, 0.04),
                                        point("a", "worse", 10, 0.2), point("a", "middle", 3, 0.2),
                                        point("a", "twin", 3, 0.2),   point("b", "alone", 99, 0.9)};
    mark_best(results);
    std::vector<bool> best;
    for (const StudyResult& result : results) best.push_back(result.best);
    EXPECT_THAT(best, ElementsAre(true, true, false, true, true, true));
}

TEST(StudyTrade, Advice_IsTheFastestWithinEachError) {
    const std::vector<StudyResult> results = {point("a", "fast", 1, 0.3), point("a", "good", 9, 0.04),
                                              point("a", "middle", 3, 0.19), point("b", "alone", 99, 0.9)};
    EXPECT_THAT(advice(results), ElementsAre("for 5 % error on a the fastest is good, spp=1 (9 s)",
                                             "for 20 % error on a the fastest is middle, spp=1 (3 s)",
                                             "for 50 % error on a the fastest is fast, spp=1 (1 s)",
                                             "on b no point is within 50 %"));
}

TEST(StudyTrade, NoisyReference_IsDoubted) {
    std::vector<StudyResult> results = {point("a", "fast", 1, 0.3), point("a", "good", 9, 0.04)};
    EXPECT_TRUE(doubts(results).empty());
    for (StudyResult& result : results) result.reference_noise2 = 0.019 * 0.019;
    EXPECT_TRUE(doubts(results).empty());
    for (StudyResult& result : results) result.reference_noise2 = 0.021 * 0.021;
    EXPECT_THAT(doubts(results),
                ElementsAre("the reference of a has 2.1 % noise, which is included in every error; the "
                            "lowest error is 4 %. Use more samples for the reference"));
}

TEST(StudyTrade, Csv_QuotesWhatHasCommas) {
    std::vector<StudyResult> results = {point("a, \"b\"", "m", 1, 0.5)};
    EXPECT_THAT(study_csv(results), HasSubstr("\"a, \"\"b\"\"\",m,spp=1,1,0.25,,,,,0,1,,0\n"));
}

}  // namespace study_test
}  // namespace lucerna
