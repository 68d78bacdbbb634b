// Images on disk: OpenEXR read and written, PNG written.
#include "engine/image/image.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>

#include "engine/base/error.h"
#include "engine/base/sampler.h"
#include "engine/colour/tone.h"
#include "engine/image/pictures.h"
#include "engine/system/files.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace image_test {

using testing::error_of;

Image noise(int width, int height, std::vector<std::string> channels) {
    Image image(width, height, std::move(channels));
    Sampler sampler(51, Purpose::test, 0, 0);
    for (float& value : image.data) value = 1e3F * (sampler.next() - 0.5F);
    return image;
}

struct Picture {
    int width = 0, height = 0, channels = 0;
    std::vector<std::uint8_t> bytes;
};
Picture read_picture(const std::filesystem::path& file) {
    const auto in = pictures(file).open(file, PictureUse::measurement);
    Picture picture{in->header().width, in->header().height, in->header().channels, {}};
    picture.bytes.resize(static_cast<std::size_t>(picture.width * picture.height * picture.channels));
    in->read({0, picture.channels}, std::span(picture.bytes));
    return picture;
}

TEST(Exr, AnyImage_WrittenAndRead_IsTheSameBitForBit) {
    const testing::TemporaryFolder folder;
    for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 33}}) {
        Image image = noise(width, height, {"R", "G", "B"});
        image.data[0] = std::numeric_limits<float>::infinity();
        image.attributes = {{"scene", "a lamp\nand a wall"}, {"empty", ""}, {"unicode", "µ×η"}};
        write_exr(folder / "a.exr", image);
        const Image back = read_exr(folder / "a.exr");
        EXPECT_EQ(back.width, width);
        EXPECT_EQ(back.height, height);
        EXPECT_EQ(back.channels, image.channels);
        EXPECT_EQ(back.data, image.data);
        for (const auto& [name, text] : image.attributes) EXPECT_EQ(back.attributes.at(name), text);
    }
}

TEST(Exr, ManyChannels_ComeBackColourFirst) {
    const testing::TemporaryFolder folder;
    const Image image = noise(5, 4, {"variance", "B", "A", "G", "R", "depth"});
    write_exr(folder / "a.exr", image);
    const Image back = read_exr(folder / "a.exr");
    EXPECT_EQ(back.channels, (std::vector<std::string>{"R", "G", "B", "A", "depth", "variance"}));
    EXPECT_EQ(back.value(3, 2, 0), image.value(3, 2, 4));
    EXPECT_EQ(back.value(3, 2, 5), image.value(3, 2, 0));
}

// The header's standard attribute states the meaning of red, green and blue: Rec. 709's primaries and white.
TEST(Exr, ColourImage_StatesItsChromaticities) {
    const testing::TemporaryFolder folder;
    const auto attribute_of = [&](const std::vector<std::string>& channels) {
        write_exr(folder / "a.exr", noise(2, 2, channels));
        std::string bytes;
        for (const std::byte b : read_bytes(folder / "a.exr")) bytes += static_cast<char>(b);
        const std::string key("chromaticities\0chromaticities\0\x20\0\0\0", 34);
        const std::size_t at = bytes.find(key);
        std::vector<float> values;
        if (at == std::string::npos) return values;
        values.resize(8);
        std::memcpy(values.data(), &bytes[at + key.size()], 32);
        return values;
    };
    EXPECT_EQ(attribute_of({"R", "G", "B", "x"}),
              (std::vector<float>{0.64F, 0.33F, 0.30F, 0.60F, 0.15F, 0.06F, 0.3127F, 0.3290F}));
    EXPECT_TRUE(attribute_of({"R", "G"}).empty());
    EXPECT_TRUE(attribute_of({"Y"}).empty());
}

TEST(Exr, NaN_IsKept) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(2, 2);
    image.data[5] = std::numeric_limits<float>::quiet_NaN();
    write_exr(folder / "a.exr", image);
    EXPECT_TRUE(std::isnan(read_exr(folder / "a.exr").data[5]));
}

TEST(Exr, BadInput_IsOneLineNamingTheFile) {
    const testing::TemporaryFolder folder;
    write_exr(folder / "whole.exr", noise(64, 64, {"R", "G", "B"}));
    const std::string whole = read_text(folder / "whole.exr");
    const auto put = [&](const char* name, const std::string& text) {
        std::ofstream(folder / name, std::ios::binary) << text;
    };
    put("garbage.exr", "not\nan image");
    put("empty.exr", "");
    for (const std::size_t length : {1UL, 4UL, 40UL, 300UL, whole.size() / 2, whole.size() - 1}) {
        put("cut.exr", whole.substr(0, length));
        const std::string message = error_of([&] { read_exr(folder / "cut.exr"); });
        EXPECT_NE(message.find("cut.exr: "), std::string::npos) << length << " bytes: " << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    for (const char* name : {"garbage.exr", "empty.exr", "missing.exr", ""}) {
        const std::string message = error_of([&] { read_exr(folder / name); });
        EXPECT_NE(message.find(name), std::string::npos) << message;
        EXPECT_NE(message, "no error") << name;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST(Exr, LyingHeader_AllocatesNothing) {
    const testing::TemporaryFolder folder;
    write_exr(folder / "a.exr", noise(4, 4, {"R"}));
    std::string text = read_text(folder / "a.exr");
    // The data window's maximum follows the name, type, size, and the two numbers of the minimum.
    const std::size_t at =
        text.find("dataWindow") + std::strlen("dataWindow") + 1 + std::strlen("box2i") + 1 + 4 + 8;
    const std::int32_t huge = 0x3fffffff;
    std::memcpy(text.data() + at, &huge, 4);
    std::memcpy(text.data() + at + 4, &huge, 4);
    std::ofstream(folder / "b.exr", std::ios::binary) << text;
    EXPECT_NE(error_of([&] { read_exr(folder / "b.exr"); }).find("b.exr: "), std::string::npos);
}

TEST(Exr, FailedWrite_LeavesTheOldFile) {
    const testing::TemporaryFolder folder;
    write_exr(folder / "a.exr", noise(3, 3, {"R"}));
    const std::string before = read_text(folder / "a.exr");
    // OpenEXR rejects duplicate and empty channel names.
    EXPECT_NE(error_of([&] { write_exr(folder / "a.exr", noise(3, 3, {""})); }), "no error");
    EXPECT_EQ(read_text(folder / "a.exr"), before);
    EXPECT_NE(error_of([&] { write_exr(folder / "no" / "a.exr", noise(3, 3, {"R"})); }), "no error");
}

TEST(Png, Grey_HasTheRightSizeAndValue) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(5, 3);
    for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 5; ++x) image.set_rgb(x, y, Rgb(0.09F));
    }
    image.set_rgb(4, 0, Rgb(0.0F));
    write_png(folder / "a.png", image, {2});
    const Picture picture = read_picture(folder / "a.png");
    ASSERT_EQ(picture.width, 5);
    ASSERT_EQ(picture.height, 3);
    ASSERT_EQ(picture.channels, 3);
    EXPECT_EQ(picture.bytes[0], 118);    // middle grey, 0.18 linear, is 117.6 in sRGB
    EXPECT_EQ(picture.bytes[3 * 4], 0);  // the upper right pixel: rows run down
    EXPECT_EQ(picture.bytes[3 * 14], 118);
}

TEST(Png, BrightColours_KeepTheirHueWithinRange) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(4, 1);
    image.set_rgb(0, 0, Rgb(2, 1, 0.4F));
    image.set_rgb(1, 0, Rgb(-1, 0.5F, 0.5F));
    image.set_rgb(2, 0, Rgb(0, 0, 30));
    image.set_rgb(3, 0, Rgb(1e30F));
    write_png(folder / "a.png", image, {});
    const Picture picture = read_picture(folder / "a.png");
    ASSERT_EQ(picture.bytes.size(), 12U);
    EXPECT_GT(picture.bytes[0], picture.bytes[1]);
    EXPECT_GT(picture.bytes[1], picture.bytes[2]);
    EXPECT_EQ(picture.bytes[3], 0);
    EXPECT_GT(picture.bytes[8], picture.bytes[6]);
    EXPECT_EQ(picture.bytes[9], 255);
}

TEST(Png, Linear_ClipsEachChannel) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(2, 1);
    image.set_rgb(0, 0, Rgb(2, 0.9F, 0.18F));
    image.set_rgb(1, 0, Rgb(0, 0, 30));
    write_png(folder / "a.png", image, {1, ToneCurve::linear});
    EXPECT_EQ(read_picture(folder / "a.png").bytes, (std::vector<std::uint8_t>{255, 243, 118, 0, 0, 255}));
}

TEST(Png, Display_WritesValuesAsTheyAre) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(2, 1);
    image.set_rgb(0, 0, Rgb(0.5F, 1, 0));
    image.set_rgb(1, 0, Rgb(7, -7, 0.2F));
    write_png_display(folder / "a.png", image);
    const Picture picture = read_picture(folder / "a.png");
    EXPECT_EQ(picture.bytes, (std::vector<std::uint8_t>{128, 255, 0, 255, 0, 51}));
}

TEST(Png, Unwritable_IsAnInputErrorNamingTheFile) {
    const testing::TemporaryFolder folder;
    const std::string message = error_of([&] { write_png(folder / "no" / "a.png", Image::rgb(2, 2), {}); });
    EXPECT_NE(message.find("a.png"), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
}

TEST(Png, NotFinite_IsShownAsBlackOrWhite) {
    const testing::TemporaryFolder folder;
    Image image = Image::rgb(3, 1);
    image.set_rgb(0, 0, Rgb(NAN));
    image.set_rgb(1, 0, Rgb(INFINITY, 0.5F, 0.5F));
    image.set_rgb(2, 0, Rgb(-INFINITY));
    const std::vector<std::uint8_t> shown{0, 0, 0, 255, 255, 255, 0, 0, 0};
    write_png(folder / "a.png", image, {});
    EXPECT_EQ(read_picture(folder / "a.png").bytes, shown);
    image.set_rgb(1, 0, Rgb(INFINITY));
    write_png_display(folder / "b.png", image);
    EXPECT_EQ(read_picture(folder / "b.png").bytes, shown);
}

TEST(ImageRgb, OneChannel_IsGrey) {
    Image image(2, 1, {"Y"});
    image.data = {0.25F, 0.75F};
    EXPECT_EQ(image.rgb_at(1, 0), Rgb(0.75F));
}

}  // namespace image_test
}  // namespace lucerna
