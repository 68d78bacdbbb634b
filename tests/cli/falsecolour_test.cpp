// `lucerna falsecolour`: what it writes, prints and refuses.
#include "engine/colour/colour_space.h"
#include "engine/image/image.h"
#include "tests/cli/run_support.h"
#include "tests/support/cannot_run.h"

namespace lucerna {
namespace falsecolour_test {

using ::testing::HasSubstr;
using ::testing::Not;
using RunFalsecolour = testing::RunTest;
using testing::lucerna_run;
using testing::Outcome;

// Returns an image in lx with R = G = B = x, and layers.
Image slope(const std::string& unit = "lx") {
    Image image(100, 40, {"R", "G", "B", "direct.R", "direct.G", "direct.B", "Z"});
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            for (int c = 0; c < 7; ++c)
                image.value(x, y, c) = c < 6 ? static_cast<float>(c < 3 ? x : 10 * x) : 1;
        }
    }
    if (!unit.empty()) image.attributes["lucerna.unit"] = unit;
    return image;
}

std::string text_of(const std::string& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

TEST_F(RunFalsecolour, Svg_HasTheUnitAndTheIsolines) {
    write_exr("lux.exr", slope());
    const Outcome outcome = lucerna_run({"falsecolour", "lux.exr", "-o", "lux.svg", "--levels", "50,20"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("lux.svg (0 to 100 lx)"));
    const std::string svg = text_of("lux.svg");
    EXPECT_THAT(svg, HasSubstr(">lx</text>"));
    EXPECT_THAT(svg, HasSubstr("data-level=\"20\""));
    EXPECT_THAT(svg, HasSubstr("data-level=\"50\""));
    EXPECT_THAT(svg, Not(HasSubstr("data-level=\"40\"")));
}

TEST_F(RunFalsecolour, Png_OfARender_IsWritten) {
    ASSERT_EQ(lucerna_run({"render", "scene.pbrt", "-o", "room.exr", "--quiet"}).code, 0);
    const Outcome outcome = lucerna_run(
        {"falsecolour", "room.exr", "-o", "room.png", "--size", "200", "--scale", "log", "--isolines"});
    if (outcome.code != 0 && outcome.err.find("needs the font") != std::string::npos)
        LUCERNA_CANNOT_RUN() << "no DejaVu Sans";
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("W/(m^2 sr), logarithmic"));
    EXPECT_GT(std::filesystem::file_size("room.png"), 2000U);
}

TEST_F(RunFalsecolour, Layers_AreShownInTheirUnit) {
    write_exr("lux.exr", slope());
    EXPECT_THAT(lucerna_run({"falsecolour", "lux.exr", "-o", "a.svg", "--layer", "direct"}).out,
                HasSubstr("0 to 1000 lx"));
    EXPECT_THAT(lucerna_run({"falsecolour", "lux.exr", "-o", "a.svg", "--layer", "Z"}).out,
                HasSubstr("0 to 1 scene units"));
    expect_refused({"falsecolour", "lux.exr", "-o", "b.svg", "--layer", "dircet"},
                   {"--layer", "\"dircet\"", "did you mean \"direct\"?"});
}

// Luminance uses the weights of the image's own colour space: a pure red has another luminance in Rec. 2020.
TEST_F(RunFalsecolour, Luminance_IsOfTheImagesOwnSpace) {
    Image image = Image::rgb(4, 4);
    for (int i = 0; i < 16; ++i) image.set_rgb(i % 4, i / 4, {100, 0, 0});
    image.attributes["lucerna.unit"] = "cd/m^2";
    const auto range = [&](const char* space) {
        image.space = find_colour_space(space);
        write_exr("red.exr", image);
        return lucerna_run({"falsecolour", "red.exr", "-o", "red.svg"}).out;
    };
    EXPECT_THAT(range("srgb"), HasSubstr("0 to 25 cd/m^2"));     // 21.27
    EXPECT_THAT(range("rec2020"), HasSubstr("0 to 30 cd/m^2"));  // 26.27
}

TEST_F(RunFalsecolour, WhatIsOutside_IsCounted) {
    Image image = slope();
    image.value(3, 3, 0) = NAN;
    write_exr("lux.exr", image);
    const Outcome outcome = lucerna_run({"falsecolour", "lux.exr", "-o", "a.svg", "--range", "10,89"});
    EXPECT_EQ(outcome.code, 0);
    EXPECT_THAT(outcome.out, HasSubstr("10 % of the pixels below, 10 % of the pixels above"));
    EXPECT_THAT(outcome.err, HasSubstr("1 of 4000 pixels are not finite"));
    EXPECT_THAT(text_of("a.svg"), HasSubstr("no value"));
}

TEST_F(RunFalsecolour, AMixtureOfUnits_IsRefusedWithAWayOut) {
    write_exr("mixed.exr", slope("mixed (some lights in W, some in lm)"));
    expect_refused({"falsecolour", "mixed.exr", "-o", "a.svg"},
                   {"mixed.exr", "no unit", "lights of one kind"});
    EXPECT_EQ(lucerna_run({"falsecolour", "mixed.exr", "-o", "a.svg", "--layer", "Z"}).code, 0);
    write_exr("bare.exr", slope(""));
    EXPECT_THAT(lucerna_run({"falsecolour", "bare.exr", "-o", "a.svg"}).out, HasSubstr("without a unit"));
}

TEST_F(RunFalsecolour, BadWords_AreRefused) {
    write_exr("lux.exr", slope());
    const std::vector<std::pair<std::vector<std::string>, std::string>> lines = {
        {{"--scale", "cubic"}, "linear or log"},
        {{"--range", "5"}, "LOW,HIGH"},
        {{"--range", "5,5"}, "LOW,HIGH"},
        {{"--range", "5,x"}, "\"x\""},
        {{"--range", "0,5", "--scale", "log"}, "above 0"},
        {{"--map", "jet"}, "known are viridis, magma, diverging"},
        {{"--map", "diverging", "--scale", "log"}, "cannot be combined"},
        {{"--levels", "1,,2"}, "--levels"},
        {{"--levels", ""}, "--levels"},
        {{"--size", "0"}, "--size"},
        {{"--smooth", "-1"}, "--smooth"},
    };
    for (const auto& [words, named] : lines) {
        std::vector<std::string> all{"falsecolour", "lux.exr", "-o", "a.svg"};
        all.insert(all.end(), words.begin(), words.end());
        expect_refused(all, {named});
    }
    expect_refused({"falsecolour", "lux.exr", "-o", "a.jpg"}, {"a.jpg", ".png or .svg"});
    expect_refused({"falsecolour", "lux.exr", "-o", "lux.exr"}, {"lux.exr"});
    expect_refused({"falsecolour", "none.exr", "-o", "a.svg"}, {"none.exr", "no such file"});
}

}  // namespace falsecolour_test
}  // namespace lucerna
