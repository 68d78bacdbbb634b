#include "engine/image/photograph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "engine/image/image.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace photograph_test {

using testing::error_of;
using testing::TemporaryFolder;

using ::testing::HasSubstr;

Photograph ramp(int most) {
    Photograph p{{7, 5}, {}, most};
    for (int i = 0; i < 35; ++i) {
        const float share = static_cast<float>(i) / 34;
        p.counts.push_back(most == 0 ? 1e-3F * share - 2e-4F : std::round(share * static_cast<float>(most)));
    }
    return p;
}

TEST(Photograph, CountsOfEveryFormat_ComeBackAsTheyAre) {
    const TemporaryFolder folder;
    for (const auto& [name, most] : std::vector<std::pair<std::string, int>>{
             {"a.png", 255}, {"b.png", 65535}, {"c.tif", 255}, {"d.TIFF", 65535}, {"e.exr", 0}}) {
        const Photograph there = ramp(most);
        write_photograph(folder / name, there);
        const Photograph back = read_photograph(folder / name);
        EXPECT_EQ(back.size, there.size) << name;
        EXPECT_EQ(back.most, most) << name;
        EXPECT_EQ(back.counts, there.counts) << name;
    }
}

TEST(Photograph, CountsOutOfRange_AreRoundedAndClamped) {
    const TemporaryFolder folder;
    write_photograph(folder / "a.png", {{4, 1}, {-3, 1.4F, 1.6F, 300}, 255});
    EXPECT_EQ(read_photograph(folder / "a.png").counts, (std::vector<float>{0, 1, 2, 255}));
}

TEST(Photograph, Colours_GiveTheirLuminanceOrOneChannel) {
    const TemporaryFolder folder;
    Image image = Image::rgb(1, 2);
    image.set_rgb(0, 0, {1, 2, 3});
    image.set_rgb(0, 1, {4, 5, 6});
    write_exr(folder / "a.exr", image);
    EXPECT_EQ(read_photograph(folder / "a.exr", "G").counts, (std::vector<float>{2, 5}));
    EXPECT_NEAR(read_photograph(folder / "a.exr").counts[0], luminance(Rgb(1, 2, 3)), 1e-6F);
    EXPECT_THAT(error_of([&] { read_photograph(folder / "a.exr", "Z"); }),
                HasSubstr("no channel \"Z\"; expected luminance, rgb or R, G, B"));
}

TEST(Photograph, WrongSuffixes_AreRefused) {
    const TemporaryFolder folder;
    EXPECT_THAT(error_of([&] { write_photograph(folder / "a.exr", ramp(255)); }),
                HasSubstr(".png, .tif or .tiff"));
    EXPECT_THAT(error_of([&] { write_photograph(folder / "a.png", ramp(0)); }),
                HasSubstr("must end in .exr"));
    EXPECT_THAT(error_of([&] { write_photograph(folder / "none" / "a.png", ramp(255)); }),
                HasSubstr("a.png"));
}

// Every prefix of a good file, and the file with changed bytes, gives counts or one line that names the
// error.
TEST(Photograph, GarbageAndTruncation_AreReadOrRefused) {
    const TemporaryFolder folder;
    EXPECT_THAT(error_of([&] { read_photograph(folder / "none.png"); }), HasSubstr("none.png"));
    for (const auto& [file, most] :
         std::vector<std::pair<std::string, int>>{{"a.png", 65535}, {"b.tif", 255}, {"c.exr", 0}}) {
        const std::string name = file;
        write_photograph(folder / name, ramp(most));
        std::ostringstream bytes;
        bytes << std::ifstream(folder / name, std::ios::binary).rdbuf();
        const std::string good = bytes.str();
        const auto refused_or_read = [&](const std::string& bad) {
            std::ofstream(folder / name, std::ios::binary | std::ios::trunc) << bad;
            const std::string error = error_of([&] { read_photograph(folder / name); });
            EXPECT_EQ(error.find('\n'), error.npos) << error;
        };
        for (std::size_t size = 0; size < good.size(); size += 5) refused_or_read(good.substr(0, size));
        std::uint32_t dice = 1;
        for (int i = 0; i < 300; ++i) {
            std::string bad = good;
            for (int k = 0; k < 2; ++k) {
                dice = dice * 1664525U + 1013904223U;
                bad[dice / 7 % bad.size()] = static_cast<char>(dice >> 24U);
            }
            refused_or_read(bad);
        }
    }
}

}  // namespace photograph_test
}  // namespace lucerna
