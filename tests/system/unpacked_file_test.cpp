#include "engine/system/unpacked_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/support/archives.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace unpacked_file_test {

using ::testing::AllOf;
using testing::gzip_of;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::zip_of;
using testing::ZipEntry;

// Poems begin with "ode".
bool is_poem(std::span<const std::byte> first) {
    return std::string_view(reinterpret_cast<const char*>(first.data()), first.size()).starts_with("ode");
}

std::string poem() {
    std::string text = "ode";
    for (int i = 0; i < 60000; ++i) text += std::to_string(i);
    return text;
}

class UnpackedFiles : public ::testing::Test {
  protected:
    UnpackedFile open(const std::string& bytes, const std::string& name = "a.bin") {
        std::ofstream(folder_ / name, std::ios::binary) << bytes;
        return {folder_ / name, is_poem, "poem"};
    }
    std::string error_text(const std::string& bytes) {
        const std::string message = testing::error_of([&] {
            UnpackedFile file = open(bytes);
            file.size();
        });
        EXPECT_THAT(message, AllOf(HasSubstr("a.bin"), Not(HasSubstr("\n"))));
        return message;
    }
    testing::TemporaryFolder folder_;
};

TEST_F(UnpackedFiles, EveryPacking_HasTheSameBytes) {
    const std::string text = poem();
    const std::vector<std::pair<std::string, std::string>> files = {
        {text, "a.bin"},
        {gzip_of(text), "a.bin"},
        {gzip_of(text.substr(0, 1000)) + gzip_of(text.substr(1000)), "a.bin"},
        {zip_of({{"poem.txt", text}}), "a.bin/poem.txt"},
        {zip_of({{"read me", "please"}, {"in/", ""}, {"in/poem", text, false}, {"empty", ""}}),
         "a.bin/in/poem"}};
    for (const auto& [bytes, name] : files) {
        UnpackedFile file = open(bytes);
        EXPECT_EQ(file.name(), (folder_ / name).string());
        EXPECT_EQ(file.size(), text.size());
        ASSERT_EQ(file.first().size(), 4096U);
        EXPECT_TRUE(is_poem(file.first()));
        std::string read(text.size(), '\0');
        file.read(read.data(), 10);
        file.skip(100000);
        file.read(read.data() + 100010, text.size() - 100010);
        EXPECT_EQ(read.substr(0, 10), text.substr(0, 10)) << name;
        EXPECT_EQ(read.substr(100010), text.substr(100010)) << name;
        EXPECT_THAT(testing::error_of([&] { file.read(read.data(), 1); }),
                    HasSubstr("before the end of the file"));
    }
    EXPECT_EQ(open("short").size(), 5U);
}

TEST_F(UnpackedFiles, Archive_MustHoldOneThatIsWanted) {
    EXPECT_THAT(
        error_text(zip_of({{"a", "ode"}, {"b/c", "ode 2"}, {"d", "prose"}})),
        HasSubstr("the zip archive holds 2 poems: a, b/c; expected one, so unpack the one to be read"));
    EXPECT_THAT(error_text(zip_of({{"a\n", "prose"}, {"b", "prose"}})),
                HasSubstr("no poem in the zip archive, which holds a, b"));
    EXPECT_THAT(error_text(zip_of({})), HasSubstr("the zip archive is empty; expected a poem"));
    std::vector<ZipEntry> many;
    for (char name = 'a'; name < 'k'; ++name) many.push_back({std::string(1, name), "ode"});
    EXPECT_THAT(error_text(zip_of(many)), HasSubstr("a, b, c, d, e, f, g, h and 2 more"));
}

TEST_F(UnpackedFiles, DamagedData_AreRefused) {
    const std::string text = poem(), gzip = gzip_of(text), zip = zip_of({{"poem", text}});
    std::string wrong = gzip;
    wrong[wrong.size() - 5] ^= 1;
    EXPECT_THAT(error_text(wrong), HasSubstr("damaged"));
    EXPECT_THAT(error_text(gzip.substr(0, gzip.size() / 2)), HasSubstr("its compressed data end too early"));
    EXPECT_THAT(error_text(zip.substr(0, zip.size() / 2)), HasSubstr("the zip archive cannot be read"));
    wrong = zip;
    wrong[zip.size() / 2] ^= 0x55;
    EXPECT_THAT(error_text(wrong), AllOf(HasSubstr("a.bin/poem"), HasSubstr("damaged")));
    EXPECT_THAT(error_text(zip_of({{"poem", text, true, true}})),
                AllOf(HasSubstr("a.bin/poem: cannot be unpacked"), HasSubstr("assword")));
}

TEST_F(UnpackedFiles, DataThatExpandTooFar_AreRefused) {
    const std::string bomb = "ode" + std::string(std::size_t{70} << 20, ' ');
    EXPECT_THAT(error_text(gzip_of(bomb)), HasSubstr("expands to more than 400 times its size"));
    EXPECT_THAT(error_text(zip_of({{"poem", bomb}})), HasSubstr("expands to more than 400 times its size"));
}

}  // namespace unpacked_file_test
}  // namespace lucerna
