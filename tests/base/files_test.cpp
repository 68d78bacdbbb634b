// Files: what is read comes back, what cannot be read says why in one line, what cannot be written leaves the
// old.
#include "engine/base/files.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using testing::error_of;

void write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream(file, std::ios::binary) << text;
}

std::size_t entries(const std::filesystem::path& folder) {
    std::size_t n = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder)) ++n;
    return n;
}

TEST(Files, Bytes_OfAnyValue_ComeBack) {
    const testing::TemporaryFolder folder;
    std::string all;
    for (int i = 0; i < 256; ++i) all += static_cast<char>(i);
    write(folder / "a", all);
    EXPECT_EQ(read_text(folder / "a"), all);
    EXPECT_EQ(read_bytes(folder / "a").size(), 256U);
    EXPECT_EQ(read_bytes(folder / "a")[200], std::byte{200});
}

TEST(Files, Unreadable_IsOneLineWithTheCause) {
    const testing::TemporaryFolder folder;
    write(folder / "empty", "");
    const auto cause = [&](const std::filesystem::path& file) { return error_of([&] { read_bytes(file); }); };
    EXPECT_EQ(cause(folder / "none"), (folder / "none").string() + ": no such file");
    EXPECT_NE(cause(folder.path()).find("is a folder"), std::string::npos);
    EXPECT_NE(cause(folder / "empty").find("empty"), std::string::npos);
    EXPECT_NE(cause(folder / "empty" / "beneath").find("no such file"), std::string::npos);
    if (geteuid() == 0) return;  // root may read anything
    write(folder / "locked", "x");
    chmod((folder / "locked").c_str(), 0);
    EXPECT_NE(cause(folder / "locked").find("cannot be opened"), std::string::npos);
}

// gzip's stored form, which needs no compressor: header, one block as it is, CRC-32, length (RFC 1951, 1952).
std::string gzip(std::string_view text) {
    std::uint32_t crc = ~0U;
    for (const char c : text) {
        crc ^= static_cast<unsigned char>(c);
        for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0xEDB88320U : 0);
    }
    const auto little = [](std::uint32_t value, int count) {
        std::string bytes;
        for (int i = 0; i < count; ++i) bytes += static_cast<char>(value >> (8 * i) & 0xff);
        return bytes;
    };
    const auto length = static_cast<std::uint32_t>(text.size());
    return std::string("\x1f\x8b\x08\0\0\0\0\0\0\xff\x01", 11) + little(length, 2) + little(~length, 2) +
           std::string(text) + little(~crc, 4) + little(length, 4);
}

TEST(Gunzip, IntactFile_ComesBackWhole) {
    const testing::TemporaryFolder folder;
    std::string text;
    for (int i = 0; i < 50'000; ++i) text += static_cast<char>(i * i % 251);
    write(folder / "one.gz", gzip(text));
    EXPECT_EQ(read_text(folder / "one.gz"), text);
    write(folder / "two.gz", gzip("first, ") + gzip("second"));
    EXPECT_EQ(read_text(folder / "two.gz"), "first, second");
}

TEST(Gunzip, UpToItsBound_IsReadAndBeyondIsRefused) {
    const testing::TemporaryFolder folder;
    write(folder / "a.gz", gzip(std::string(10'000, 'x')));
    const std::vector<std::byte> packed = read_bytes(folder / "a.gz");
    EXPECT_EQ(gunzip(packed, "a.gz", 10'000).size(), 10'000U);
    EXPECT_EQ(error_of([&] { gunzip(packed, "a.gz", 9'999); }),
              "a.gz: unpacks to more than 9999 bytes; no more are accepted");
}

TEST(Gunzip, DamagedOrCutOff_SaysSo) {
    const testing::TemporaryFolder folder;
    const std::string whole = gzip("some text that is long enough");
    write(folder / "cut.gz", whole.substr(0, whole.size() - 10));
    EXPECT_NE(error_of([&] { read_text(folder / "cut.gz"); }).find("end too early"), std::string::npos);
    std::string wrong = whole;
    wrong[20] = static_cast<char>(wrong[20] ^ 1);  // the checksum no longer fits
    write(folder / "wrong.gz", wrong);
    EXPECT_NE(error_of([&] { read_text(folder / "wrong.gz"); }).find("damaged"), std::string::npos);
}

TEST(Files, Replace_Succeeding_LeavesOnlyTheNewFile) {
    const testing::TemporaryFolder folder;
    write(folder / "a", "old");
    replace_file(folder / "a", [](const std::filesystem::path& temporary) { write(temporary, "new"); });
    EXPECT_EQ(read_text(folder / "a"), "new");
    EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(Files, Replace_Failing_LeavesTheOldFile) {
    const testing::TemporaryFolder folder;
    write(folder / "a", "old");
    const std::string message = error_of([&] {
        replace_file(folder / "a", [](const std::filesystem::path& temporary) {
            write(temporary, "half of the n");
            throw std::runtime_error("disk\nfull");
        });
    });
    EXPECT_EQ(message, (folder / "a").string() + ": cannot be written: disk full");
    EXPECT_EQ(read_text(folder / "a"), "old");
    EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(Files, Replace_NoSuchFolderOrAFolder_IsAnInputError) {
    const testing::TemporaryFolder folder;
    const auto put = [](const std::filesystem::path& temporary) { write(temporary, "x"); };
    EXPECT_NE(error_of([&] { replace_file(folder / "no" / "a", put); }).find("cannot be written"),
              std::string::npos);
    std::filesystem::create_directory(folder / "taken");
    EXPECT_NE(error_of([&] { replace_file(folder / "taken", put); }).find("cannot be written"),
              std::string::npos);
    EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(Files, OneLine_AnyBreaks_AreFolded) {
    EXPECT_EQ(one_line("a\nb\r\nc \n d\n"), "a b c  d");
    EXPECT_EQ(one_line(""), "");
    EXPECT_EQ(one_line("\n\n"), "");
}

TEST(InputErrors, Location_IsFileLineColumn) {
    EXPECT_EQ(to_string(Location{"a.pbrt", 3, 14}), "a.pbrt:3:14");
    EXPECT_EQ(to_string(Location{"a.pbrt"}), "a.pbrt");
    EXPECT_EQ(error_of([] { input_error({"a", 1, 2}, "{} is {}", "x", 5); }), "a:1:2: x is 5");
}

}  // namespace
}  // namespace lucerna
