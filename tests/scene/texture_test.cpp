#include "engine/scene/texture_image.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <fstream>
#include <limits>

#include "engine/base/error.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace texture_test {

std::shared_ptr<Image> two_by_two() {
    auto image = std::make_shared<Image>(Image::rgb(2, 2));
    image->set_rgb(0, 0, Rgb(1, 0, 0));  // upper left
    image->set_rgb(1, 0, Rgb(0, 1, 0));
    image->set_rgb(0, 1, Rgb(0, 0, 1));
    image->set_rgb(1, 1, Rgb(1, 1, 1));
    return image;
}

RgbTexture of_image(std::shared_ptr<const Image> image, const V2f& scale = V2f(1, 1)) {
    ImageLookup lookup;
    lookup.mapping = UvMapping{scale, {0, 0}};
    return image_texture<Rgb>(texels_of(std::move(image)), lookup);
}

void expect_rgb(const Rgb& is, const Rgb& should, float near = 1e-5F) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(is[c], should[c], near) << is << " should be " << should;
}

std::string message_of(const std::filesystem::path& file) {
    try {
        read_texture_image(file);
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(Texture, Constant_Anywhere_IsTheSame) {
    const auto texture = RgbTexture::constant(Rgb(0.1F, 0.2F, 0.3F));
    EXPECT_EQ(texture.at(V2f(-7, 1e9F)), Rgb(0.1F, 0.2F, 0.3F));
}

TEST(Texture, Checkerboard_Squares_Alternate) {
    const auto board = RgbTexture::checkerboard(Rgb(0.0F), Rgb(1.0F), V2f(2, 4));
    EXPECT_EQ(board.at(V2f(0, 0)), Rgb(0.0F));
    EXPECT_EQ(board.at(V2f(0.49F, 0.24F)), Rgb(0.0F));
    EXPECT_EQ(board.at(V2f(0.51F, 0.24F)), Rgb(1.0F));
    EXPECT_EQ(board.at(V2f(0.51F, 0.26F)), Rgb(0.0F));
    EXPECT_EQ(board.at(V2f(-0.01F, 0)), Rgb(1.0F));
    EXPECT_EQ(board.at(V2f(-0.01F, -0.01F)), Rgb(0.0F));
    EXPECT_EQ(board.at(V2f(500'000.25F, 0)), Rgb(0.0F));
}

TEST(Texture, Image_TexelCentres_AreExact) {
    const auto texture = of_image(two_by_two());
    expect_rgb(texture.at(V2f(0.25F, 0.75F)), Rgb(1, 0, 0));  // v runs upwards: the upper left texel
    expect_rgb(texture.at(V2f(0.75F, 0.75F)), Rgb(0, 1, 0));
    expect_rgb(texture.at(V2f(0.25F, 0.25F)), Rgb(0, 0, 1));
    expect_rgb(texture.at(V2f(0.75F, 0.25F)), Rgb(1, 1, 1));
}

TEST(Texture, Image_BetweenCentres_IsBilinear) {
    const auto texture = of_image(two_by_two());
    expect_rgb(texture.at(V2f(0.5F, 0.75F)), Rgb(0.5F, 0.5F, 0));
    expect_rgb(texture.at(V2f(0.5F, 0.5F)), Rgb(0.5F, 0.5F, 0.5F));
    expect_rgb(texture.at(V2f(0.375F, 0.75F)), Rgb(0.75F, 0.25F, 0));
    // Across the seam, the last column is the neighbour of the first.
    expect_rgb(texture.at(V2f(0, 0.75F)), Rgb(0.5F, 0.5F, 0));
}

TEST(Texture, Image_Scaled_Repeats) {
    const auto once = of_image(two_by_two());
    const auto thrice = of_image(two_by_two(), V2f(3, 2));
    for (const V2f& uv : {V2f(0.1F, 0.2F), V2f(0.77F, 0.4F), V2f(-0.3F, 0.9F)}) {
        expect_rgb(thrice.at(uv), once.at(V2f(3 * uv.x, 2 * uv.y)));
        expect_rgb(once.at(V2f(uv.x + 5, uv.y - 7)), once.at(uv), 1e-4F);
    }
}

RC_GTEST_PROP(TextureProperties, Image_AnyCoordinate_StaysWithinTheTexels, (float u, float v)) {
    const auto texture = of_image(two_by_two());
    for (const float other : {v, 0.0F, -1e-30F, 1e38F, INFINITY, -INFINITY, NAN}) {
        for (const Rgb& c : {texture.at(V2f(u, other)), texture.at(V2f(other, u))}) {
            RC_ASSERT(is_finite(c) && std::min({c.x, c.y, c.z}) >= 0 && max_component(c) <= 1.00001F);
        }
    }
}

TEST(TextureFile, EightBit_IsDecodedFromSrgb) {
    const testing::TemporaryFolder folder;
    Image picture = Image::rgb(3, 2);
    picture.set_rgb(0, 0, Rgb(0.5F, 0, 1));
    picture.set_rgb(2, 1, Rgb(0.02F, 0.25F, 0.75F));
    write_png_display(folder / "a.png", picture);
    const auto image = read_texture_image(folder / "a.png");
    ASSERT_EQ(image->width, 3);
    ASSERT_EQ(image->height, 2);
    expect_rgb(image->rgb_at(0, 0), Rgb(0.2158605F, 0, 1));                    // 128/255
    expect_rgb(image->rgb_at(2, 1), Rgb(0.0015176F, 0.0512695F, 0.5209956F));  // 5, 64, 191 of 255
}

TEST(TextureFile, Float_IsTakenAsItIs) {
    const testing::TemporaryFolder folder;
    Image picture = Image::rgb(2, 1);
    picture.set_rgb(0, 0, Rgb(0.5F, 0.125F, 3));
    write_exr(folder / "a.exr", picture);
    EXPECT_EQ(read_texture_image(folder / "a.exr")->rgb_at(0, 0), Rgb(0.5F, 0.125F, 3));
}

TEST(TextureFile, Grey_BecomesThreeEqualChannels) {
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "a.pgm", std::ios::binary) << "P5 2 1 255\n" << '\0' << '\xff';
    const auto image = read_texture_image(folder / "a.pgm");
    EXPECT_EQ(image->rgb_at(0, 0), Rgb(0.0F));
    EXPECT_EQ(image->rgb_at(1, 0), Rgb(1.0F));
}

TEST(TextureFile, BadInput_IsOneLineNamingTheFile) {
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "garbage.png") << "this is\nnot a picture";
    std::ofstream(folder / "empty.png").flush();
    write_png_display(folder / "whole.png", Image::rgb(64, 64));
    std::filesystem::copy(folder / "whole.png", folder / "cut.png");
    std::filesystem::resize_file(folder / "cut.png", 60);
    Image dark = Image::rgb(2, 2);
    dark.set_rgb(1, 0, Rgb(0, -1, 0));
    write_exr(folder / "negative.exr", dark);
    dark.set_rgb(1, 0, Rgb(0, std::numeric_limits<float>::quiet_NaN(), 0));
    write_exr(folder / "nan.exr", dark);
    for (const char* name :
         {"missing.png", "garbage.png", "empty.png", "cut.png", "negative.exr", "nan.exr"}) {
        const std::string message = message_of(folder / name);
        EXPECT_NE(message.find(name), std::string::npos) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
    EXPECT_NE(message_of(folder.path()).find("folder"), std::string::npos);
    EXPECT_NE(message_of(folder / "negative.exr").find("pixel (1, 0)"), std::string::npos);
}

}  // namespace texture_test
}  // namespace lucerna
