// The pictures, pages and options of `lucerna compare`.
#include <nlohmann/json.hpp>
#include <random>

#include "engine/cli/page_parts.h"
#include "engine/evaluation/error_pictures.h"
#include "engine/figures/colour_maps.h"
#include "engine/image/image.h"
#include "engine/image/photograph.h"
#include "engine/system/files.h"
#include "tests/cli/run_support.h"

namespace lucerna {
namespace compare_pictures_test {

using ::testing::HasSubstr;
using ::testing::Not;
using RunComparison = testing::RunTest;
using testing::lucerna_run;
using testing::Outcome;

Image grey(float value, int width = 12, int height = 8, bool variance = true) {
    Image image = Image::rgb(width, height);
    if (variance) image = Image(width, height, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    for (std::size_t i = 0; i < image.data.size(); ++i)
        image.data[i] = i % image.channels.size() < 3 ? value : 0.01F;
    return image;
}

Image noisy_grey(float value, unsigned seed) {
    Image image = grey(value);
    std::mt19937 generator(seed);
    std::normal_distribution<float> noise(0, 0.1F);
    for (std::size_t i = 0; i < image.data.size(); ++i) {
        if (i % 6 < 3) image.data[i] += noise(generator);
    }
    return image;
}

TEST(ErrorPictures, Diverging_IsRedAboveBlueBelowPaleAtZero) {
    const Rgb none = diverging_colour(0), above = diverging_colour(0.8), below = diverging_colour(-0.8);
    EXPECT_GT(std::min({none.x, none.y, none.z}), 0.9F);
    EXPECT_GT(above.x, 2 * above.z);
    EXPECT_GT(below.z, 2 * below.x);
    EXPECT_EQ(diverging_colour(5), diverging_colour(1));
    EXPECT_EQ(diverging_colour(NAN), none);
    double before = 2;
    for (double v = 0; v <= 1; v += 0.1) {  // equally dark on either side, and darker outwards
        const auto grey_of = [](const Rgb& c) { return double{luminance(c)}; };
        EXPECT_LT(grey_of(diverging_colour(v)), before);
        EXPECT_NEAR(grey_of(diverging_colour(v)), grey_of(diverging_colour(-v)), 0.12);
        before = grey_of(diverging_colour(v));
    }
}

TEST(ErrorPictures, Magma_RisesFromBlackToPale) {
    float before = -1;
    for (double v = 0; v <= 1; v += 0.05) {
        EXPECT_GT(luminance(magma_colour(v)), before);
        before = luminance(magma_colour(v));
    }
    EXPECT_NEAR(magma_colour(0.5).x, 0xb7 / 255.0F, 1e-6F);
    EXPECT_EQ(magma_colour(-3), magma_colour(0));
    EXPECT_EQ(magma_colour(NAN), magma_colour(0));
}

TEST(ErrorPictures, RelativeError_GoesWithTheImage) {
    Image t = grey(1.1F, 2, 1, false), r = grey(1, 2, 1, false);
    EXPECT_NEAR(double{relative_error(t, r).data[0]}, 0.1 / 1.1, 1e-5);
    for (float& v : t.data) v *= 1e6F;
    for (float& v : r.data) v *= 1e6F;
    EXPECT_NEAR(double{relative_error(t, r).data[0]}, 0.1 / 1.1, 1e-5);
    EXPECT_EQ(relative_error(grey(0, 2, 1), grey(0, 2, 1)).data[0], 0);
    EXPECT_GT(relative_error(grey(1, 2, 1), grey(0, 2, 1)).data[0], 1e30F);
}

TEST(ErrorPictures, Scale_IsARoundNumberAboveMostErrors) {
    Image errors(100, 1, {"error"});
    for (int x = 0; x < 100; ++x) errors.value(x, 0, 0) = (x % 2 == 0 ? 1.0F : -1.0F) * 0.034F;
    errors.value(50, 0, 0) = 70;
    EXPECT_NEAR(error_scale(errors), 0.05, 1e-12);
    EXPECT_EQ(error_scale(Image(3, 3, {"error"})), 1);
}

TEST(ErrorPictures, Radiance_ComesBackWithinItsBits) {
    Image image = Image::rgb(6, 1);
    const Rgb values[] = {Rgb(0.7F, 0.2F, 0.01F), Rgb(1e-20F),  Rgb(3e20F, 1, 0), Rgb(0),
                          Rgb(NAN, 1, 1),         Rgb(-1, 2, 0)};
    for (int x = 0; x < 6; ++x) image.set_rgb(x, 0, values[x]);
    const Image picture = radiance_picture(image);
    ASSERT_EQ(picture.height, 2);
    for (const int x : {0, 1, 2, 5}) {
        const int exponent = static_cast<int>(std::lround(picture.value(x, 1, 0) * 255));
        for (int c = 0; c < 3; ++c) {
            const float mantissa = std::round(picture.value(x, 0, c) * 255) + 0.5F;
            const float back = std::ldexp(mantissa / 256, exponent - 128);
            EXPECT_NEAR(back, std::max(0.0F, image.value(x, 0, c)), max_component(values[x]) / 256);
        }
    }
    EXPECT_EQ(picture.value(3, 1, 0), 0);
    EXPECT_EQ(picture.value(4, 1, 0), 1);
}

TEST(PageParts, Texts_CannotEndTheirPlace) {
    EXPECT_EQ(html_text("<a b='c\">&"), "&lt;a b=&#39;c&quot;&gt;&amp;");
    EXPECT_EQ(script_text("</script>\n\"\\"), "\"\\u003c/script\\u003e\\u000a\\u0022\\u005c\"");
    EXPECT_EQ(filled("a {{x}} b {{y}}", {{"x", "{{y}}"}, {"y", "2"}}), "a {{y}} b 2");
    EXPECT_THROW(filled("{{z}}", {}), std::out_of_range);
}

TEST(PageParts, DataUrl_IsAPng) {
    EXPECT_THAT(data_url(Image::rgb(1, 1)), ::testing::StartsWith("data:image/png;base64,iVBORw0KGgo"));
}

TEST_F(RunComparison, OneImage_HasFlipAndVerdictInTextAndJson) {
    write_exr("a.exr", noisy_grey(1, 1));
    write_exr("r.exr", noisy_grey(1, 2));
    const Outcome outcome = lucerna_run({"compare", "a.exr", "r.exr", "--json", "n.json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const char* part :
         {"FLIP ", "HDR-FLIP", "verdict", "equal within the noise", "beyond 3 sigma", "mean z"})
        EXPECT_THAT(outcome.out, HasSubstr(part));
    const auto json = nlohmann::json::parse(read_text("n.json"));
    EXPECT_GT(json["flip"]["ldr"]["mean"], 0);
    EXPECT_GE(json["flip"]["hdr"]["exposures"], 2);
    EXPECT_TRUE(json["z_test"]["verdict"]["equal"]);
    EXPECT_EQ(json["z_test"]["beyond"].size(), 3U);
    EXPECT_FALSE(json.contains("seeds"));
    const Outcome without = lucerna_run({"compare", "a.exr", "r.exr", "--no-flip", "--json", "-"});
    EXPECT_FALSE(nlohmann::json::parse(without.out).contains("flip"));
}

TEST_F(RunComparison, BrighterImage_IsDifferent) {
    write_exr("a.exr", noisy_grey(1.2F, 1));
    write_exr("r.exr", noisy_grey(1, 2));
    EXPECT_THAT(lucerna_run({"compare", "a.exr", "r.exr", "--no-flip"}).out, HasSubstr("DIFFERENT"));
}

TEST_F(RunComparison, SeveralSeeds_TellBiasFromNoise) {
    std::vector<std::string> words{"compare"};
    for (unsigned seed = 0; seed < 4; ++seed) {
        const std::string name = "s" + std::to_string(seed) + ".exr";
        write_exr(name, noisy_grey(1.3F, seed));
        words.push_back(name);
    }
    write_exr("r.exr", grey(1));
    words.insert(words.end(), {"r.exr", "--json", "n.json", "--html", "p.html"});
    const Outcome outcome = lucerna_run(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("4 seeds"));
    EXPECT_THAT(outcome.out, HasSubstr("bias^2"));
    const auto json = nlohmann::json::parse(read_text("n.json"));
    ASSERT_EQ(json["images"].size(), 4U);
    EXPECT_EQ(json["images"][2]["image"], "s2.exr");
    const auto& parts = json["seeds"]["absolute"];
    // The reference states a variance of 0.01 that it does not have, so that amount is subtracted.
    EXPECT_NEAR(parts["bias2"]["value"].get<double>(), 0.09 - 0.01, 0.02);
    EXPECT_NEAR(parts["noise2"]["value"].get<double>(), 0.01, 0.002);
    EXPECT_GT(parts["bias2"]["standard_error"].get<double>(), 0);
    EXPECT_NEAR(json["mse"].get<double>(), parts["mse"]["value"].get<double>(), 1e-9);
    EXPECT_THAT(read_text("p.html"), HasSubstr("noise of one image"));
}

TEST_F(RunComparison, Maps_AreColoursOrValues) {
    Image a = grey(1);
    a.value(2, 3, 0) = a.value(2, 3, 1) = a.value(2, 3, 2) = 2;
    write_exr("a.exr", a);
    write_exr("r.exr", grey(1));
    const Outcome outcome =
        lucerna_run({"compare", "a.exr", "r.exr", "--signed", "s.exr", "--flip", "f.exr"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const Image difference = read_exr("s.exr"), flips = read_exr("f.exr");
    EXPECT_EQ(difference.rgb_at(2, 3), Rgb(1));
    EXPECT_EQ(difference.rgb_at(3, 3), Rgb(0));
    EXPECT_EQ(flips.channels, (std::vector<std::string>{"flip", "hdr_flip"}));
    EXPECT_GT(flips.value(2, 3, 0), flips.value(11, 3, 0));
    EXPECT_EQ(
        lucerna_run({"compare", "a.exr", "r.exr", "--signed", "s.png", "--flip", "f.png", "--range", "10%"})
            .code,
        1);
    EXPECT_EQ(
        lucerna_run({"compare", "a.exr", "r.exr", "--signed", "s.png", "--flip", "f.png", "--range", "0.1"})
            .code,
        0);
    EXPECT_GT(std::filesystem::file_size("s.png"), 60U);
    EXPECT_GT(std::filesystem::file_size("f.png"), 60U);
}

TEST_F(RunComparison, Page_CarriesAllItNeeds) {
    write_exr("a<b>.exr", noisy_grey(1, 1));
    write_exr("r.exr", noisy_grey(1, 2));
    ASSERT_EQ(lucerna_run({"compare", "a<b>.exr", "r.exr", "--html", "p.html"}).code, 0);
    const std::string page = read_text("p.html");
    for (const char* part :
         {"a&lt;b&gt;.exr", "imageStrip", "HDR-FLIP", "signed error", "data:image/png", "MSE"})
        EXPECT_THAT(page, HasSubstr(part));
    for (const char* part : {"http:", "https:", "{{", "<a<b>", "src=\"/"})
        EXPECT_THAT(page, Not(HasSubstr(part)));
}

TEST_F(RunComparison, Mask_LeavesPixelsOutOfFlipToo) {
    Image a = grey(1), r = grey(1);
    for (int c = 0; c < 3; ++c) a.value(2, 2, c) = 9, r.value(2, 2, c) = 50;
    write_exr("a.exr", a);
    write_exr("r.exr", r);
    const auto flip_of = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{"compare", "a.exr", "r.exr", "--json", "-"};
        words.insert(words.end(), more.begin(), more.end());
        return nlohmann::json::parse(lucerna_run(words).out)["flip"]["hdr"]["mean"].get<double>();
    };
    EXPECT_GT(flip_of({}), 0);
    EXPECT_EQ(flip_of({"--mask", "4"}), 0);
}

TEST_F(RunComparison, GreyAndUnfitImages_HaveTheirAnswer) {
    Image y(3, 2, {"Y"});
    for (float& v : y.data) v = 1;
    write_exr("y.exr", y);
    EXPECT_EQ(lucerna_run({"compare", "y.exr", "y.exr"}).code, 0);
    write_exr("nan.exr", grey(NAN));
    const Outcome nothing = lucerna_run({"compare", "nan.exr", "nan.exr", "--html", "p.html"});
    EXPECT_EQ(nothing.code, 0) << nothing.err;
    EXPECT_THAT(nothing.err, HasSubstr("no pixel can be compared"));
    write_exr("a.exr", grey(1));
    write_exr("small.exr", grey(1, 4, 4));
    expect_refused({"compare", "a.exr", "small.exr", "a.exr"}, {"small.exr", "4 x 4", "12 x 8"});
    expect_refused({"compare", "a.exr", "y.exr"}, {"3 x 2"});
    expect_refused({"compare", "a.exr", "a.exr", "--html", "p.txt"}, {"p.txt", ".html"});
    expect_refused({"compare", "a.exr", "a.exr", "--flip", "f.jpg"}, {"f.jpg", ".png", ".exr"});
    expect_refused({"compare", "a.exr", "a.exr", "--signed", "none/s.png"}, {"none"});
    expect_refused({"compare", "a.exr", "a.exr", "--ppd", "0"}, {"--ppd", "\"0\""});
    expect_refused({"compare", "a.exr", "a.exr", "--flip", "f.png", "--no-flip"}, {"--no-flip"});
}

TEST_F(RunComparison, Threads_ChangeNothing) {
    write_exr("a.exr", noisy_grey(1, 1));
    write_exr("r.exr", noisy_grey(1, 2));
    EXPECT_EQ(lucerna_run({"compare", "a.exr", "r.exr", "--json", "-", "--threads", "1"}).out,
              lucerna_run({"compare", "a.exr", "r.exr", "--json", "-", "--threads", "3"}).out);
}

}  // namespace compare_pictures_test
}  // namespace lucerna
