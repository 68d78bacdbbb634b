// The plug-in interface of picture formats: which formats it opens, and the errors when no plug-in is there.
#include "engine/image/pictures.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cfenv>
#include <fstream>
#include <thread>

#include "engine/base/error.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace pictures_test {

using testing::error_of;
using testing::TemporaryFolder;

using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr const char* kLibrary = "liblucerna_pictures.so";

std::filesystem::path folder_of_the_library() {
    for (const auto& folder : library_folders()) {
        if (std::filesystem::exists(folder / kLibrary)) return folder;
    }
    return {};
}

TEST(Pictures, Missing_NamesTheFileTheLibraryAndWhereItWasSought) {
    const TemporaryFolder one, other;
    EXPECT_EQ(error_of([&] {
                  pictures("wall.png", {one.path(), other.path()});
              }),
              fmt::format("wall.png: pictures need {}, which was not found in {}, {}", kLibrary,
                          one.path().string(), other.path().string()));
    EXPECT_THAT(error_of([] { pictures("wall.png", {}); }), StartsWith("wall.png: pictures need"));
}

TEST(Pictures, NoLibrary_IsOneLineWithTheLinkersCause) {
    const TemporaryFolder folder;
    for (const char* text : {"", "not\na library",
                             "\x7f"
                             "ELF\n"}) {
        std::ofstream(folder / kLibrary, std::ios::binary | std::ios::trunc) << text;
        EXPECT_THAT(error_of([&] { pictures("wall.png", {folder.path()}); }),
                    AllOf(StartsWith("wall.png: pictures need"), HasSubstr("cannot be loaded: "),
                          HasSubstr((folder / kLibrary).string()), Not(HasSubstr("\n"))));
    }
}

TEST(Pictures, AnotherVersion_IsRefused) {
    const TemporaryFolder folder;
    const std::filesystem::path here = folder_of_the_library();
    std::ifstream in(here / kLibrary, std::ios::binary);
    std::string bytes(std::istreambuf_iterator<char>(in), {});
    // Every occurrence of the entry's name in the string tables is replaced by that of a future version.
    const std::string entry = "lucerna_pictures_4";
    int found = 0;
    for (std::size_t at = bytes.find(entry); at != bytes.npos; at = bytes.find(entry, at + 1), ++found) {
        bytes[at + entry.size() - 1] = '5';
    }
    ASSERT_GT(found, 0);
    std::ofstream(folder / kLibrary, std::ios::binary) << bytes;
    EXPECT_THAT(error_of([&] { pictures("wall.png", {folder.path()}); }),
                EndsWith(fmt::format("{} is of another version of Lucerna", (folder / kLibrary).string())));
}

TEST(Pictures, FirstFolderThatHasIt_Counts) {
    const TemporaryFolder empty;
    const std::filesystem::path here = folder_of_the_library();
    ASSERT_FALSE(here.empty());
    EXPECT_EQ(&pictures("a.png", {empty.path(), here}), &pictures("a.png"));
}

TEST(Pictures, AskedByManyThreadsAtOnce_AreLoadedOnce) {
    std::vector<const Pictures*> seen(8, nullptr);
    {
        std::vector<std::jthread> threads;
        for (const Pictures*& mine : seen) threads.emplace_back([&mine] { mine = &pictures("a.png"); });
    }
    EXPECT_EQ(seen, std::vector<const Pictures*>(8, &pictures("a.png")));
    EXPECT_NE(seen.front(), nullptr);
}

TEST(Pictures, Loading_LeavesRoundingAsItWas) {
    std::fesetround(FE_UPWARD);
    pictures("a.png");
    EXPECT_EQ(std::fegetround(), FE_UPWARD);
    std::fesetround(FE_TONEAREST);
    const volatile float least = std::numeric_limits<float>::denorm_min();
    EXPECT_GT(least * 1.0F, 0.0F) << "denormals are not flushed";
}

TEST(Pictures, Written_SayOfThemselvesWhatTheyAre) {
    const TemporaryFolder folder;
    const std::vector<std::uint16_t> words{0, 1, 256, 65535, 7, 8};
    const Pictures* const formats = &pictures(folder / "a");
    // The format is detected by content: the file has no suffix.
    formats->write(folder / "a", {PictureFormat::tiff, 3, 2, 1, std::span<const std::uint16_t>(words)});
    const auto in = formats->open(folder / "a", PictureUse::measurement);
    const PictureHeader& header = in->header();
    EXPECT_EQ(header.width, 3);
    EXPECT_EQ(header.height, 2);
    EXPECT_TRUE(header.flat);
    EXPECT_EQ(header.numbers, PictureNumbers::words);
    EXPECT_EQ(header.kind, "uint16");
    EXPECT_EQ(header.bits, 16);
    EXPECT_EQ(header.channels, 1);
    EXPECT_EQ(header.channel_names, std::vector<std::string>{"Y"});
    std::vector<std::uint16_t> back(6);
    in->read({0, 1}, std::span(back));
    EXPECT_EQ(back, words);
    std::vector<float> shares(6);
    in->read({0, 1}, std::span(shares));
    EXPECT_EQ(shares[3], 1);
    EXPECT_FLOAT_EQ(shares[2], 256.0F / 65535);
}

TEST(Pictures, TilesOfAFile_OutliveTheirCache) {
    const TemporaryFolder folder;
    std::vector<std::uint8_t> bytes(100 * 70 * 3);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 31 % 251);
    const Pictures* const formats = &pictures(folder / "a.png");
    formats->write(folder / "a.png", {PictureFormat::png, 100, 70, 3, std::span<const std::uint8_t>(bytes)});
    std::unique_ptr<TileCache> cache = formats->tiles(std::size_t{1} << 20);
    const auto picture = cache->open(folder / "a.png", {0, 3});
    std::array<std::uint8_t, 12> corner{};  // the corner where four tiles meet
    EXPECT_THROW(cache->open(folder / "none.png", {0, 3})->read({63, 65, 63, 65}, std::span(corner)),
                 std::runtime_error);
    cache.reset();
    picture->read({63, 65, 63, 65}, std::span(corner));
    for (std::size_t i = 0; i < corner.size(); ++i) {
        const std::size_t x = 63 + i / 3 % 2, y = 63 + i / 6;
        EXPECT_EQ(corner[i], bytes[(y * 100 + x) * 3 + i % 3]) << i;
    }
}

}  // namespace pictures_test
}  // namespace lucerna
