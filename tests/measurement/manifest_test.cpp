#include "lights/measurement/manifest.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace manifest_test {

using testing::error_of;

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kHead = "unit = \"lm\"\n";  // line 1
const std::string kRig =                      // lines 2 to 8
    "[rig]\nsetup = \"A\"\nviews = [3, 2]\nspacing = \"1.4mm\"\npixels = [15, 10]\npixel = \"0.2mm\"\n"
    "distance = \"39mm\"\n";
const std::string kShots =  // lines 9 to 11
    "[photographs]\nname = \"v_{m:03}_{n}_{sign}_{exposure:02}.png\"\nexposures = [0.5, 2]\n";
const std::string kCamera = "[camera]\nscale = 1e-3\n";  // lines 12 and 13

Manifest manifest_of(const std::string& text) {
    return read_manifest(TomlTable::parse(text, "folder/manifest.toml"));
}

std::string fault(const std::string& text) {
    return error_of([&] { manifest_of(text); });
}

TEST(Manifest, Pattern_NamesEveryPhotograph) {
    const Manifest m = manifest_of(
        kHead + kRig + kShots + "negative_exposures = [4]\nnegative = \"minus\"\ncount_from = 1\n" + kCamera);
    EXPECT_EQ(m.rig.shift, V2i(7, 7));
    EXPECT_EQ(m.shot_count(), 18U);
    const std::vector<Shot> shots = m.shots(2, 0, FilterSign::positive);
    ASSERT_EQ(shots.size(), 2U);
    EXPECT_EQ(shots[1].file, "folder/v_003_1_positive_02.png");
    EXPECT_EQ(shots[1].seconds, 2);
    ASSERT_EQ(m.shots(0, 1, FilterSign::negative).size(), 1U);
    EXPECT_EQ(m.shots(0, 1, FilterSign::negative)[0].file, "folder/v_001_2_minus_01.png");
    EXPECT_FALSE(m.camera.noise_known);
    EXPECT_FALSE(m.corners);
}

TEST(Manifest, Widths_FillWithZerosOrSpaces) {
    EXPECT_EQ(ShotName({"x"}, "{m:3}{n:02}{m}").of({7, 123, 0, ""}), "  71237");
}

TEST(Manifest, Written_ReadsTheSame) {
    const std::string full =
        "unit = \"W\"\nflux = 2.5\nsetback = \"2 cm\"\ncolour = [1, 0.5, 0.25]\nprovenance = 'a \"lamp\" \\ "
        "ü'\n" +
        kRig + "[photographs]\nname = \"{m}-{n}{sign}{exposure}.tif\"\nexposures = [0.1, 0.3]\n" +
        "negative_exposures = [0.1, 3]\npositive = \"p\"\ncount_from = 3\nchannel = \"G\"\n" +
        "[photographs.corners]\nlower_left = [1.5, 90]\nlower_right = [99, 91]\nupper_right = [97, 3]\n" +
        "upper_left = [2, 1.25]\n[camera]\nscale = 0.1\ntransmission = [0.9, 0.85]\npedestal = 64\n" +
        "gain = 1.7\nread_noise = 2.25\nsaturated = 4000\nblack = 1\n" +
        "[[dark]]\nseconds = 0.1\nfile = \"d0.tif\"\n[[dark]]\nseconds = 3\nfile = \"sub/d1.tif\"\n";
    const Manifest m = manifest_of(full);
    EXPECT_DOUBLE_EQ(double{m.rig.centre.z}, 0.02);
    const Manifest again = manifest_of(manifest_text(m));
    EXPECT_EQ(manifest_text(again), manifest_text(m));
    EXPECT_EQ(again.rig.spacing, m.rig.spacing);
    EXPECT_EQ(again.info.provenance, "a \"lamp\" \\ ü");
    EXPECT_EQ(again.info.colour, m.info.colour);
    EXPECT_EQ(again.corners, m.corners);
    EXPECT_EQ(again.camera.transmission, V2d(0.9, 0.85));
    EXPECT_EQ(again.shots(1, 1, FilterSign::negative)[1].file, "folder/4-4negative4.tif");
    EXPECT_EQ(again.darks[1].file, "folder/sub/d1.tif");
    EXPECT_EQ(again.flux, 2.5);
    EXPECT_TRUE(again.camera.noise_known);
    EXPECT_EQ(again.camera.black, 1);
}

std::string listed(int m, int n, const char* sign, double seconds, const std::string& file) {
    return fmt::format("[[photograph]]\nview = [{}, {}]\nsign = \"{}\"\nseconds = {}\nfile = \"{}\"\n", m, n,
                       sign, seconds, file);
}

TEST(Manifest, ListedPhotographs_AreSortedByTime) {
    std::string text = kHead + kRig + "[photographs]\n" + kCamera;
    for (int m = 0; m < 3; ++m) {
        for (int n = 0; n < 2; ++n) {
            for (const char* sign : {"positive", "negative"}) {
                for (const double seconds : {4.0, 0.5, 2.0})
                    text += listed(m, n, sign, seconds, fmt::format("{}{}{}{}.exr", m, n, sign, seconds));
            }
        }
    }
    const Manifest m = manifest_of(text);
    EXPECT_EQ(m.shot_count(), 36U);
    const std::vector<Shot> shots = m.shots(2, 1, FilterSign::negative);
    ASSERT_EQ(shots.size(), 3U);
    EXPECT_EQ(shots[0].seconds, 0.5);
    EXPECT_EQ(shots[2].file, "folder/21negative4.exr");
    EXPECT_THAT(fault(text + listed(2, 1, "negative", 9, "21negative4.exr")), HasSubstr("listed twice"));
}

TEST(Manifest, MissingViews_AreCountedAndNamed) {
    const std::string some =
        kHead + kRig + "[photographs]\n" + kCamera + listed(0, 0, "positive", 1, "a.png");
    EXPECT_THAT(fault(some),
                HasSubstr("11 of 12 views and films have no [[photograph]]: view [0, 0] negative, view "
                          "[0, 1] positive, view [0, 1] negative, ..."));
    EXPECT_THAT(fault(some + listed(3, 0, "positive", 1, "b.png")),
                HasSubstr("view [3, 0] is outside the 3 x 2 views; expected [0, 0] to [2, 1]"));
}

TEST(Manifest, Mistakes_OfEveryKind_NamePlaceValueAndWhatIsAccepted) {
    const auto good = [](const std::string& head, const std::string& shots, const std::string& camera) {
        return fault(head + kRig + shots + camera);
    };
    EXPECT_EQ(good(kHead, kShots, kCamera), "no error");
    EXPECT_THAT(good("", kShots, kCamera), HasSubstr("lacks \"unit\""));
    EXPECT_THAT(good("unit = \"cd\"\n", kShots, kCamera),
                AllOf(StartsWith("folder/manifest.toml:1:8:"), HasSubstr("W, lm")));
    EXPECT_THAT(good(kHead + "setpack = \"1m\"\n", kShots, kCamera), HasSubstr("did you mean \"setback\""));
    EXPECT_THAT(fault(kHead + kShots + kCamera), HasSubstr("lacks \"rig\""));
    EXPECT_THAT(fault(kHead + kRig + kCamera), HasSubstr("lacks \"photographs\""));
    EXPECT_THAT(good(kHead, kShots, ""), HasSubstr("lacks \"camera\""));

    const auto shots = [&](const std::string& text) {
        return good(kHead, "[photographs]\n" + text, kCamera);
    };
    EXPECT_THAT(shots("exposures = [1]\n"),
                AllOf(StartsWith("folder/manifest.toml:9:"), HasSubstr("lacks \"name\"")));
    EXPECT_THAT(shots("name = \"{m}{n}.png\"\nexposures = [1]\n"),
                HasSubstr("lacks {sign}, which distinguishes 2 films"));
    EXPECT_THAT(shots("name = \"{n}{sign}.png\"\nexposures = [1]\n"), HasSubstr("lacks {m}"));
    EXPECT_THAT(shots("name = \"{m}{n}{sign}.png\"\nexposures = [1, 2]\n"), HasSubstr("lacks {exposure}"));
    EXPECT_THAT(shots("name = \"{m}{n}{sing}.png\"\nexposures = [1]\n"), HasSubstr("did you mean \"sign\""));
    EXPECT_THAT(shots("name = \"{m}{n}{sign.png\"\nexposures = [1]\n"), HasSubstr("{ without its }"));
    EXPECT_THAT(shots("name = \"{m:x}{n}{sign}\"\nexposures = [1]\n"), HasSubstr("\"x\" is not"));
    const std::string name = "name = \"{m}{n}{sign}{exposure}\"\n";
    EXPECT_THAT(shots(name + "exposures = []\n"), HasSubstr("0 values; expected 1 to 32"));
    EXPECT_THAT(shots(name + "exposures = [2, 1]\n"), HasSubstr("1 s after 2 s; expected ascending times"));
    EXPECT_THAT(shots(name + "exposures = [-1]\n"), StartsWith("folder/manifest.toml:11:14:"));
    EXPECT_THAT(shots(name + "exposures = [1]\npositive = \"negative\"\n"),
                HasSubstr("both films are called"));
    EXPECT_THAT(shots(name + "exposures = [1]\ncrop = [1, 2, 3]\n"),
                HasSubstr("left, top, width and height"));
    EXPECT_THAT(shots(name + "exposures = [1]\ncrop = [1, 2, 3, 0]\n"), HasSubstr("the last two > 0"));
    const std::string corners =
        "[photographs.corners]\nlower_left = [0, 9]\nlower_right = [9, 9]\nupper_left = [0, 0]\n";
    EXPECT_THAT(shots(name + "exposures = [1]\n" + corners), HasSubstr("lacks \"upper_right\""));
    EXPECT_THAT(shots(name + "exposures = [1]\n" + corners + "upper_right = [1]\n"),
                HasSubstr("x and y in pixels"));
    EXPECT_THAT(shots(name + "exposures = [1]\n" + corners + "upper_right = [0, 9]\n"),
                AllOf(StartsWith("folder/manifest.toml:12:"), HasSubstr("convex quadrilateral")));
    EXPECT_THAT(shots(name + "exposures = [1]\ncrop = [0, 0, 1, 1]\n" + corners + "upper_right = [9, 0]\n"),
                HasSubstr("use one of them"));
    EXPECT_THAT(shots(name + "exposures = [1]\n" + listed(0, 0, "positive", 1, "a.png")),
                HasSubstr("exclude each other"));

    const auto camera = [&](const std::string& text) { return good(kHead, kShots, "[camera]\n" + text); };
    EXPECT_THAT(camera(""), HasSubstr("[camera] lacks \"scale\""));
    EXPECT_THAT(camera("scale = 0\n"),
                AllOf(StartsWith("folder/manifest.toml:13:9:"), HasSubstr("\"scale\" of 0")));
    EXPECT_THAT(camera("scale = 1\ntransmission = [1]\n"),
                HasSubstr("the positive and of the negative film"));
    EXPECT_THAT(camera("scale = 1\nsaturated = 5\nblack = 5\n"), HasSubstr("is not above"));
    EXPECT_THAT(camera("scale = 1\ngian = 5\n"), HasSubstr("did you mean \"gain\""));
    EXPECT_THAT(good(kHead, kShots, kCamera + "[[dark]]\nseconds = 1\n"), HasSubstr("[dark] lacks \"file\""));
}

TEST(Manifest, NoFile_IsNamed) {
    EXPECT_THAT(error_of([] { read_manifest(std::filesystem::path("nowhere/manifest.toml")); }),
                HasSubstr("nowhere/manifest.toml"));
}

}  // namespace manifest_test
}  // namespace lucerna
