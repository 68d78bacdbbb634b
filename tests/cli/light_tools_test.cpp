// `lucerna light project`, `view` and `info`: what they write and what they refuse.
#include <algorithm>
#include <cmath>

#include "engine/figures/figure.h"
#include "engine/image/image.h"
#include "engine/image/photograph.h"
#include "lights/light_field.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace light_tools_test {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::lucerna_run;
using testing::Outcome;
using ::testing::StartsWith;

class LightTools : public testing::RunTest {
  protected:
    void SetUp() override {
        RunTest::SetUp();
        // The single lit coefficient is off-centre in every dimension, so that the test detects a flip.
        Rig rig;
        rig.views = {5, 4};
        rig.spacing = {0.001, 0.001};
        rig.pixels = {6, 8};
        rig.pixel = {0.01, 0.01};
        rig.distance = 0.1;
        rig.centre = {0, 0, 0.002};
        std::vector<float> e(rig.coefficients());
        e[rig.index(3, 1, 5, 6)] = 1e9F;
        e[rig.index(0, 0, 0, 0)] = -1e7F;
        LightFieldInfo info;
        info.unit = FluxUnit::lumen;
        info.captured = 99, info.missed = 1;
        write_light_field("lamp.exr", LightField(rig, std::move(e), info));
    }
};

TEST_F(LightTools, Project_OntoM_LightsThePixelUprightInLux) {
    const Outcome done = lucerna_run({"light", "project", "lamp.exr", "--distance", "100mm", "--size",
                                      "60mmx80mm", "--pixels", "6x8", "-o", "wall.exr", "--png"});
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr(" lx"));
    const Image wall = read_exr("wall.exr");
    EXPECT_EQ(wall.attributes.at("lucerna.unit"), "lx");
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 6; ++x) {
            const bool lit = x == 5 && y == 8 - 1 - 6;  // t = 6 is the second row from the top
            if (lit) {
                EXPECT_NEAR(wall.value(x, y, 1), 1e9F * 1e-6F, 0.01F * 1e9F * 1e-6F);
            } else {
                EXPECT_LT(wall.value(x, y, 1), 1.0F) << x << ", " << y;
            }
        }
    }
    EXPECT_TRUE(std::filesystem::exists("wall.png"));
}

TEST_F(LightTools, Project_Series_WritesOneImagePerDistanceAndOnePicture) {
    const Outcome done = lucerna_run({"light", "project", "lamp.exr", "--distance", "0,20mm,0.5m", "--pixels",
                                      "16x16", "-o", "beam.exr", "--png"});
    ASSERT_EQ(done.code, 0) << done.err;
    for (const char* name : {"beam-0mm.exr", "beam-20mm.exr", "beam-500mm.exr", "beam.png"})
        EXPECT_TRUE(std::filesystem::exists(name)) << name;
    EXPECT_FALSE(std::filesystem::exists("beam.exr"));
    // The three are in one row, above captions that are wider than they are.
    const Photograph sheet = read_photograph("beam.png");
    const Photograph one = [] {
        lucerna_run({"light", "project", "lamp.exr", "--distance", "20mm", "--pixels", "16x16", "-o",
                     "one.exr", "--png"});
        return read_photograph("one.png");
    }();
    EXPECT_GE(sheet.size.x, 3 * one.size.x);
    EXPECT_EQ(sheet.size.y, one.size.y);
}

// The caption that the values of the image give is below the picture, pixel by pixel.
TEST_F(LightTools, Project_Picture_StatesDistanceSizeAndIrradiance) {
    ASSERT_EQ(lucerna_run({"light", "project", "lamp.exr", "--distance", "100mm", "--size", "60mmx80mm",
                           "--pixels", "6x8", "-o", "wall.exr", "--png"})
                  .code,
              0);
    const Image wall = read_exr("wall.exr");
    double peak = 0, sum = 0;
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 6; ++x) {
            peak = std::max(peak, double{wall.value(x, y, 1)});
            sum += double{wall.value(x, y, 1)};
        }
    }
    const Caption caption{{"distance 100 mm", "60 mm × 80 mm", "peak " + value_text(peak) + " lx",
                           "mean " + value_text(sum / 48) + " lx"},
                          2,  // of six pixels for 60 mm
                          "20 mm"};
    const Image expected = drawn(caption_svg(caption, caption_width(caption)), "caption.png");
    const Photograph found = read_photograph("wall.png");
    ASSERT_EQ(found.size, V2i(expected.width, 8 + expected.height));
    const auto count_at = [&found](int x, int y) {
        return found.counts[static_cast<std::size_t>(y * found.size.x + x)];
    };
    EXPECT_EQ(count_at(6, 0), 255) << "white beside the picture";
    int different = 0;
    for (int y = 0; y < expected.height; ++y) {
        for (int x = 0; x < expected.width; ++x)
            different += std::fabs(count_at(x, 8 + y) - 255 * expected.rgb_at(x, y).y) > 1.5F ? 1 : 0;
    }
    EXPECT_EQ(different, 0);
}

TEST_F(LightTools, Project_AtAHeight_CountsFromTheLampsOwnOrigin) {
    ASSERT_EQ(lucerna_run({"light", "project", "lamp.exr", "--height", "102mm", "--size", "60mmx80mm",
                           "--pixels", "6x8", "-o", "height.exr"})
                  .code,
              0);
    ASSERT_EQ(lucerna_run({"light", "project", "lamp.exr", "--distance", "100mm", "--size", "60mmx80mm",
                           "--pixels", "6x8", "-o", "distance.exr"})
                  .code,
              0);
    const Image height = read_exr("height.exr"), distance = read_exr("distance.exr");
    for (std::size_t i = 0; i < height.data.size(); ++i)
        EXPECT_NEAR(height.data[i], distance.data[i], 1e-3F * 1000) << i;
    EXPECT_THAT(lucerna_run({"light", "project", "lamp.exr", "--height", "1mm", "-o", "behind.exr"}).err,
                HasSubstr("behind the lamp's sampling plane"));
}

TEST_F(LightTools, Project_ByTheApproximateReconstruction_IsAnotherPicture) {
    const std::vector<std::string> words = {"light",  "project",   "lamp.exr", "--distance", "100mm",
                                            "--size", "60mmx80mm", "--pixels", "6x8"};
    const auto with = [&](std::vector<std::string> more) {
        more.insert(more.begin(), words.begin(), words.end());
        return lucerna_run(more);
    };
    ASSERT_EQ(with({"-o", "exact.exr"}).code, 0);
    ASSERT_EQ(with({"-o", "approximate.exr", "--reconstruction", "approximate"}).code, 0);
    // One filter lights the pixel from 53 mm off its axis; at the centre of both, the reconstructions would
    // not differ.
    const float exact = read_exr("exact.exr").value(5, 1, 1);
    const float approximate = read_exr("approximate.exr").value(5, 1, 1);
    EXPECT_NE(exact, approximate);
    EXPECT_NEAR(approximate, exact, 0.02F * exact);
}

TEST_F(LightTools, View_OfALightField_ShowsEveryViewWhereItsFilterStood) {
    const Outcome done = lucerna_run({"light", "view", "lamp.exr", "-o", "sheet.png"});
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("34 x 35"));  // 5 views of 6, 4 of 8, with lines between
    EXPECT_TRUE(std::filesystem::exists("sheet.png"));
}

TEST_F(LightTools, Info_OfALightField_TellsLossesNegativeLightAndHash) {
    const Outcome done = lucerna_run({"light", "info", "lamp.exr"});
    ASSERT_EQ(done.code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("captured, missed     99 lm (99 %), 1 lm (1 %)"));
    EXPECT_THAT(done.out, HasSubstr("which sum to 1.01 % of the flux"));
    EXPECT_THAT(done.out, HasSubstr("content hash"));
}

TEST_F(LightTools, WrongInputs_AreRefusedInOneLineAndNothingIsWritten) {
    const auto before = files();
    write("garbage.exr", "this is no lamp");
    const auto refused = [&](std::vector<std::string> words, const char* says) {
        words.insert(words.begin(), "light");
        const Outcome outcome = lucerna_run(words);
        EXPECT_EQ(outcome.code, 1);
        EXPECT_THAT(outcome.err, AllOf(StartsWith("lucerna: "), HasSubstr(says)));
        EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    };
    refused({"project", "lamp.exr", "-o", "a.exr"}, "--distance");
    refused({"project", "lamp.exr", "--distance", "5", "-o", "a.exr"}, "\"5\" is not a position");
    refused({"project", "lamp.exr", "--distance", "1m,", "-o", "a.exr"}, "\"\" is not a position");
    refused({"project", "lamp.exr", "--distance", "-1m", "-o", "a.exr"}, "behind the lamp's sampling plane");
    refused({"project", "garbage.exr", "--distance", "1m", "-o", "a.exr"}, "garbage.exr");
    refused({"project", "missing.exr", "--distance", "1m", "-o", "a.exr"}, "missing.exr");
    refused({"project", "lamp.exr", "--distance", "1m", "--reconstruction", "rough", "-o", "a.exr"},
            "expected exact or approximate");
    refused({"view", "garbage.exr", "-o", "a.png"}, "garbage.exr");
    refused({"view", "lamp.exr", "-o", "a.jpg"}, "a.jpg");
    std::filesystem::remove("garbage.exr");
    EXPECT_EQ(files(), before);
}

}  // namespace light_tools_test
}  // namespace lucerna
