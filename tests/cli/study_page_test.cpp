// The contents of a study's page and the bound on its size. tests/pages/study_page_test.py tests it in a
// browser.
#include "engine/cli/study/study_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/cli/page_parts.h"
#include "engine/evaluation/error_pictures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace study_page_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(StudyPictures, FewSmallImages_KeepAllPixels) {
    const std::vector<PictureLoad> few{{128, 128, 6, 20}, {240, 160, 6, 20}};
    const PictureCaps caps = picture_caps(few, kPicturesBudget);
    for (const double cap : {caps.best, caps.maps, caps.rest}) EXPECT_EQ(shrink_factor(240, 160, cap), 1);
}

TEST(StudyPictures, HundredRunsOf512_FitAndTheBestKeepTheirPixels) {
    const std::vector<PictureLoad> many{{512, 512, 8, 92}};
    const PictureCaps caps = picture_caps(many, kPicturesBudget);
    EXPECT_LE(most_bytes(many, caps), kPicturesBudget);
    EXPECT_EQ(shrink_factor(512, 512, caps.best), 1);
    EXPECT_LE(shrink_factor(512, 512, caps.rest), 8);
}

TEST(StudyPictures, AnyStudy_FitsTheBudget) {
    EXPECT_TRUE(rc::check([] {
        std::vector<PictureLoad> scenes;
        const int count = *rc::gen::inRange(1, 5);
        for (int i = 0; i < count; ++i) {
            scenes.push_back({*rc::gen::inRange(1, 20'000), *rc::gen::inRange(1, 20'000),
                              static_cast<std::size_t>(*rc::gen::inRange(0, 3000)),
                              static_cast<std::size_t>(*rc::gen::inRange(0, 10'000))});
        }
        RC_ASSERT(most_bytes(scenes, picture_caps(scenes, kPicturesBudget)) <= kPicturesBudget);
    }));
}

TEST(StudyPictures, ShrinkFactor_IsTheLeastThatFits) {
    EXPECT_EQ(shrink_factor(512, 512, 512.0 * 512), 1);
    EXPECT_EQ(shrink_factor(512, 512, 512.0 * 512 - 1), 2);
    EXPECT_EQ(shrink_factor(10'000, 1, 100), 100);
    EXPECT_EQ(shrink_factor(3, 2, 1), 3);
}

// Noise of every brightness is the worst case for an encoder of pictures.
TEST(StudyPictures, WildNoise_NeedsNoMoreThanStated) {
    std::mt19937 random(3);
    std::normal_distribution<float> normal;
    Image noise = Image::rgb(256, 256), codes = Image::rgb(256, 256);
    for (float& v : noise.data) v = std::exp(3 * normal(random));
    std::uniform_int_distribution<int> byte(0, 255);
    for (int y = 0; y < 256; ++y) {
        for (int x = 0; x < 256; ++x)
            codes.set_rgb(
                x, y, Rgb(static_cast<float>(byte(random)), static_cast<float>(byte(random)), 0) / 255.0F);
    }
    const double radiance = static_cast<double>(data_url(radiance_picture(noise)).size());
    const double maps = static_cast<double>(data_url(codes).size());
    EXPECT_LE(radiance, most_bytes({{256, 256, 0, 0}}, {1e9, 1e9, 1e9}));
    EXPECT_LE(radiance + maps + radiance, most_bytes({{256, 256, 1, 0}}, {1e9, 1e9, 1e9}));
}

TEST(StudyPictures, ErrorCode_KeepsSignAndSize) {
    constexpr ErrorCode kCode;
    const auto decoded = [&](int byte) {
        const double size =
            kCode.least * std::expm1(std::abs(byte - 128) / 127.0 * std::log1p(kCode.most / kCode.least));
        return byte < 128 ? -size : size;
    };
    for (const double error : {0.01, 0.05, 0.3, 2.0, 19.0}) {
        EXPECT_NEAR(decoded(kCode.of(error)) / error, 1, 0.05);
        EXPECT_NEAR(decoded(kCode.of(-error)) / -error, 1, 0.05);
    }
    EXPECT_EQ(kCode.of(0), 128);
    EXPECT_EQ(kCode.of(1e30), 255);
    EXPECT_EQ(kCode.of(-1e30), 1);
    EXPECT_EQ(kCode.of(std::nan("")), 128);
}

// A study of one scene whose renders are made up.
class StudyPage : public ::testing::Test {
  protected:
    StudyPage() {
        description_.title = "Ends </script> & <b>";
        description_.seeds = 2;
        description_.scenes.resize(2);  // the second scene has no results yet
        description_.scenes[0].name = "</script><script>alert(1)</script>";
        description_.reference.overrides.integrator = "path";
        description_.reference.settings = "spp=64";
        write_image("reference.exr", 1);
        add("slow & good", 4, 0.05, 1.05F);
        add("fast", 1, 0.5, 1.5F);
        add("slow & bad", 5, 0.8, 0.2F);
        mark_best(results_);
    }
    void write_image(const std::string& name, float level) {
        Image image = Image::rgb(12, 8);
        for (int y = 0; y < 8; ++y) {
            for (int x = 0; x < 12; ++x) image.set_rgb(x, y, Rgb(level * static_cast<float>(1 + x % 3)));
        }
        write_exr(folder_.path() / name, image);
    }
    void add(const std::string& method, double seconds, double error, float level) {
        const std::string file = std::to_string(results_.size()) + ".exr";
        write_image(file, level);
        StudyResult result;
        result.scene = description_.scenes[0].name;
        result.method = method;
        result.settings = "spp=4";
        result.set = {{"spp", "4"}};
        result.seconds = seconds;
        result.error2 = error * error;
        result.image = folder_.path() / file;
        results_.push_back(result);
        description_.points.push_back({method, "spp=4", {}, 0, "spp", "4"});
    }
    std::string page() {
        Monitor silent;
        const auto pictures =
            study_pictures(description_, {folder_.path() / "reference.exr"}, results_, {1}, silent);
        return study_page(
            {description_, results_, pictures, origin_, "lucerna study a.toml -o 'x y'", "plan <text>"});
    }
    static nlohmann::json data_of(const std::string& page) {
        const std::string open = "studyPage({", close = ");\n</script>";
        const std::size_t at = page.rfind(open) + open.size() - 1;
        return nlohmann::json::parse(page.substr(at, page.find(close, at) - at));
    }

    testing::TemporaryFolder folder_;
    StudyDescription description_;
    StudyOrigin origin_{{"Machine One"}, {2}, {"2026-01-01", "2026-01-03"}};
    std::vector<StudyResult> results_;
};

TEST_F(StudyPage, Data_AreTheResults) {
    const nlohmann::json data = data_of(page());
    ASSERT_EQ(data["scenes"].size(), 1U);
    const auto& points = data["scenes"][0]["points"];
    ASSERT_EQ(points.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(points[i]["method"], results_[i].method);
        EXPECT_EQ(points[i]["seconds"], results_[i].seconds);
        EXPECT_DOUBLE_EQ(points[i]["error"].get<double>(), results_[i].error());
        EXPECT_EQ(points[i]["best"], results_[i].best);
        EXPECT_EQ(points[i]["flip"], *results_[i].flip);
        EXPECT_THAT(points[i]["radiance"]["src"].get<std::string>(), HasSubstr("data:image/png;base64,"));
    }
    EXPECT_EQ(data["methods"], nlohmann::json({"slow & good", "fast", "slow & bad"}));
    EXPECT_EQ(data["signed"].size(), 768U);
}

TEST_F(StudyPage, Flip_GrowsWithTheDifference) {
    page();
    EXPECT_GT(*results_[0].flip, 0);
    EXPECT_GT(*results_[1].flip, 2 * *results_[0].flip);
}

TEST_F(StudyPage, Names_EndNoScriptAndNoTag) {
    const std::string text = page();
    EXPECT_THAT(text, Not(HasSubstr("alert(1)</script>")));
    EXPECT_THAT(text, HasSubstr("Ends &lt;/script&gt; &amp; &lt;b&gt;"));
    EXPECT_EQ(data_of(text)["scenes"][0]["name"], description_.scenes[0].name);
}

TEST_F(StudyPage, Origin_IsShown) {
    const std::string text = page();
    for (const char* part : {"2026-01-01 to 2026-01-03", "Machine One",
                             "lucerna study a.toml -o &#39;x y&#39;", "plan &lt;text&gt;", "path, spp=64"})
        EXPECT_THAT(text, HasSubstr(part));
    EXPECT_THAT(text, Not(HasSubstr("times cannot be compared")));
    origin_.machines.insert("Machine Two");
    EXPECT_THAT(page(), HasSubstr("times cannot be compared"));
}

TEST_F(StudyPage, Nothing_IsAskedOfANetwork) {
    const std::string text = page();
    for (const char* tag : {"<link rel=\"stylesheet", "<script src", "@import", "url(http", "src=\"http"})
        EXPECT_THAT(text, Not(HasSubstr(tag)));
    EXPECT_THAT(text, HasSubstr("default-src 'none'"));
    EXPECT_THAT(text, HasSubstr(std::string(kD3.substr(0, 60))));
}

}  // namespace study_page_test
}  // namespace lucerna
