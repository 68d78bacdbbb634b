// Valid, damaged, truncated and synthetic PNGs: the guard refuses whatever would make libpng complain on
// standard error, before libpng reads it.
#include "engine/image/pictures.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "engine/colour/tone.h"
#include "engine/image/image.h"
#include "engine/system/files.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace png_guard_test {

using ::testing::HasSubstr;

// Computes the specification's CRC [PNG, annex D], bit by bit.
std::uint32_t check_of(const std::string& bytes) {
    std::uint32_t c = 0xFFFFFFFF;
    for (const char byte : bytes) {
        c ^= static_cast<unsigned char>(byte);
        for (int bit = 0; bit < 8; ++bit) c = (c & 1) != 0 ? 0xEDB88320 ^ (c >> 1) : c >> 1;
    }
    return ~c;
}

std::string word(std::uint32_t number) {
    std::string bytes;
    for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(number >> shift & 0xFF);
    return bytes;
}

std::string chunk(const std::string& type, const std::string& content) {
    return word(static_cast<std::uint32_t>(content.size())) + type + content + word(check_of(type + content));
}

std::string header(std::uint32_t width, std::uint32_t height, int bits, int colours, int packing = 0,
                   int filter = 0, int interlace = 0) {
    std::string content = word(width) + word(height);
    for (const int number : {bits, colours, packing, filter, interlace}) content += static_cast<char>(number);
    return chunk("IHDR", content);
}

const std::string kSignature = "\x89PNG\r\n\x1A\n";
const std::string kPixels = chunk("IDAT", "pixels"), kEnd = chunk("IEND", "");

class PngGuard : public ::testing::Test {
  protected:
    std::string refusal(const std::string& bytes) const {
        std::ofstream(folder_ / "a.png", std::ios::binary) << bytes;
        return testing::error_of([&] { check_png_chunks(folder_ / "a.png"); });
    }
    std::string refusal_of(const std::string& chunks) const { return refusal(kSignature + chunks); }

    testing::TemporaryFolder folder_;
};

TEST_F(PngGuard, APictureOfOurs_IsFine) {
    Image image = Image::rgb(7, 5);
    for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 11) / 11;
    write_png(folder_ / "ours.png", image, {});
    const std::string whole = read_text(folder_ / "ours.png");
    EXPECT_EQ(refusal(whole), "no error");
    for (std::size_t size = kSignature.size(); size + 8 < whole.size(); ++size)
        EXPECT_THAT(refusal(whole.substr(0, size)), HasSubstr("is cut off")) << size;
}

TEST_F(PngGuard, AnyByteOfTheHeaderOrThePixelsChanged_IsRefused) {
    const std::string needed = header(3, 2, 8, 2) + kPixels;
    ASSERT_EQ(refusal_of(needed + kEnd), "no error");
    for (std::size_t i = 0; i < needed.size(); ++i) {
        std::string damaged = needed;
        damaged[i] = static_cast<char>(damaged[i] ^ 1);
        EXPECT_THAT(refusal_of(damaged + kEnd), HasSubstr("PNG")) << i;
    }
    // Chunks that a decoder may ignore may be damaged.
    std::string remark = chunk("tEXt", "remark");
    remark.back() = static_cast<char>(remark.back() ^ 1);
    EXPECT_EQ(refusal_of(header(3, 2, 8, 2) + remark + kPixels + kEnd), "no error");
}

TEST_F(PngGuard, KindsOfColours_AreThoseOfTheSpecification) {
    const std::string palette = chunk("PLTE", "rgbrgb");
    std::string known;
    for (int colours = 0; colours < 8; ++colours) {
        for (int bits = 0; bits < 256; ++bits) {
            if (refusal_of(header(3, 2, bits, colours) + palette + kPixels + kEnd) == "no error")
                known += fmt::format("{}:{} ", colours, bits);
        }
    }
    EXPECT_EQ(known, "0:1 0:2 0:4 0:8 0:16 2:8 2:16 3:1 3:2 3:4 3:8 4:8 4:16 6:8 6:16 ");
}

TEST_F(PngGuard, OtherHeaders_AreRefused) {
    for (const std::string& bad :
         {header(0, 2, 8, 2), header(3, 0, 8, 2), header(1'000'001, 2, 8, 2), header(3, 0xFFFFFFFF, 8, 2),
          header(3, 2, 8, 2, 1), header(3, 2, 8, 2, 0, 1), header(3, 2, 8, 2, 0, 0, 2)})
        EXPECT_THAT(refusal_of(bad + kPixels + kEnd), HasSubstr("chunk IHDR at byte 8 ")) << bad;
    EXPECT_THAT(refusal_of(kPixels + kEnd), HasSubstr("is not the header"));
    EXPECT_THAT(refusal_of(""), HasSubstr("is cut off"));
}

TEST_F(PngGuard, ChunksThatAreMissingUnknownOrInTheWrongPlace_AreRefused) {
    const std::string colours = header(3, 2, 8, 2), indices = header(3, 2, 8, 3),
                      palette = chunk("PLTE", "rgb");
    EXPECT_THAT(refusal_of(colours + kEnd), HasSubstr("no pixels"));
    EXPECT_THAT(refusal_of(colours + kPixels), HasSubstr("is cut off"));
    EXPECT_THAT(refusal_of(colours + chunk("WHAT", "") + kPixels + kEnd),
                HasSubstr("chunk WHAT at byte 33 "));
    EXPECT_EQ(refusal_of(indices + palette + kPixels + kEnd), "no error");
    EXPECT_THAT(refusal_of(indices + kPixels + kEnd), HasSubstr("not preceded by a palette"));
    EXPECT_THAT(refusal_of(indices + palette + palette + kPixels + kEnd), HasSubstr("out of order"));
    EXPECT_THAT(refusal_of(indices + chunk("PLTE", "rg") + kPixels + kEnd),
                HasSubstr("not a valid palette size"));
    EXPECT_EQ(refusal_of(colours + chunk("PLTE", "rg") + kPixels + kEnd), "no error") << "only a hint";
    EXPECT_THAT(refusal_of(colours + word(0x80000000) + "IDAT"), HasSubstr("claims 2147483648 bytes"));
    EXPECT_THAT(refusal_of(colours + word(0x7FFFFFFF) + "IDAT"), HasSubstr("is cut off"));
}

}  // namespace png_guard_test
}  // namespace lucerna
