// Files: reading returns what is written, unreadable files give a reason in one line, and a failed write
// keeps the old file.
#include "engine/system/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <tuple>
#include <vector>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"
#include "tests/support/error_of.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace files_test {

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

// Drops root's permissions for its lifetime; has no effect for other users.
class AsNobody {
  public:
    AsNobody() {
        if (own_ == 0 && seteuid(65534) != 0) throw std::runtime_error("root cannot become nobody");
    }
    ~AsNobody() {
        if (own_ == 0 && seteuid(0) != 0) std::abort();
    }
    AsNobody(const AsNobody&) = delete;
    AsNobody& operator=(const AsNobody&) = delete;

  private:
    uid_t own_ = geteuid();
};

TEST(Files, Unreadable_IsOneLineWithTheCause) {
    const testing::TemporaryFolder folder;
    write(folder / "empty", "");
    const auto cause = [&](const std::filesystem::path& file) { return error_of([&] { read_bytes(file); }); };
    EXPECT_EQ(cause(folder / "none"), (folder / "none").string() + ": no such file");
    EXPECT_NE(cause(folder.path()).find("is a folder"), std::string::npos);
    EXPECT_NE(cause(folder / "empty").find("empty"), std::string::npos);
    EXPECT_NE(cause(folder / "empty" / "beneath").find("no such file"), std::string::npos);
    write(folder / "locked", "x");
    chmod((folder / "locked").c_str(), 0);
    chmod(folder.path().c_str(), 0755);
    {
        const AsNobody not_root;  // root may read any file
        EXPECT_NE(cause(folder / "locked").find("cannot be opened"), std::string::npos);
    }
}

// Returns gzip's stored form, which needs no compressor: header, one stored block, CRC-32, length (RFC 1951,
// 1952).
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

// Blanks pack a thousand times.
TEST(Gunzip, UpToItsBound_IsReadAndBeyondIsRefused) {
    const testing::TemporaryFolder folder;
    const std::filesystem::path file = folder / "a.gz";
    const auto pack = [&](const char* mode, std::size_t size) {
        const std::string blanks(size, ' ');
        const gzFile out = gzopen(file.c_str(), mode);
        gzwrite(out, blanks.data(), static_cast<unsigned>(size));
        gzclose(out);
    };
    constexpr std::size_t kBound = std::size_t{64} << 20;
    pack("wb", kBound);
    EXPECT_EQ(read_text(file), std::string(kBound, ' '));
    EXPECT_EQ(read_unpacked(file).size(), kBound);
    pack("ab", 1);  // a second piece, whose size is the only one stated
    const std::string refusal =
        file.string() + ": expands to more than 400 times its size; such files may be at most 64 MiB";
    EXPECT_EQ(error_of([&] { read_text(file); }), refusal);
    EXPECT_EQ(error_of([&] { read_unpacked(file); }), refusal);
    pack("wb", kBound + 1);
    EXPECT_EQ(error_of([&] { read_text(file); }), refusal);
}

TEST(Gunzip, DamagedOrCutOff_SaysSo) {
    const testing::TemporaryFolder folder;
    const std::string whole = gzip("some text that is long enough");
    write(folder / "cut.gz", whole.substr(0, whole.size() - 10));
    EXPECT_NE(error_of([&] { read_text(folder / "cut.gz"); }).find("end too early"), std::string::npos);
    std::string wrong = whole;
    wrong[20] = static_cast<char>(wrong[20] ^ 1);  // the checksum does not match
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

// --- special files in the place of a regular one

TEST(Files, NoRegularFile_IsRefusedWithoutWaiting) {
    const testing::TemporaryFolder folder;
    ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
    std::filesystem::create_symlink(folder / "pipe", folder / "link to pipe");
    std::filesystem::create_symlink("nowhere", folder / "dangling");
    std::filesystem::create_symlink("loop", folder / "loop");
    const auto cause = [](const std::filesystem::path& file) {
        alarm(2);  // ends the test program if the reader waits
        std::string text = error_of([&] { read_bytes(file); });
        EXPECT_EQ(error_of([&] { read_text(file); }), text);
        EXPECT_EQ(error_of([&] { open_to_read(file); }), text);
        alarm(0);
        return text.substr(file.string().size());
    };
    EXPECT_EQ(cause(folder / "pipe"), ": is a pipe; expected a regular file");
    EXPECT_EQ(cause(folder / "link to pipe"), ": is a pipe; expected a regular file");
    EXPECT_EQ(cause("/dev/zero"), ": is a device; expected a regular file");
    EXPECT_EQ(cause(folder / "dangling"), ": no such file: a broken link");
    EXPECT_EQ(cause(folder / "loop"), ": cannot be opened: Too many levels of symbolic links");
}

void put_new(const std::filesystem::path& temporary) {
    write(temporary, "new");
}

TEST(Files, Replace_OfALink_KeepsItAndReplacesWhatItLeadsTo) {
    const testing::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "far");
    write(folder / "far" / "a", "old");
    std::filesystem::create_symlink("far/a", folder / "middle");
    std::filesystem::create_symlink(folder / "middle", folder / "link");
    replace_file(folder / "link", put_new);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "link"));
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "middle"));
    EXPECT_FALSE(std::filesystem::is_symlink(folder / "far" / "a"));
    EXPECT_EQ(read_text(folder / "far" / "a"), "new");
    std::filesystem::create_symlink("far/b", folder / "dangling");
    replace_file(folder / "dangling", put_new);
    EXPECT_TRUE(std::filesystem::is_symlink(folder / "dangling"));
    EXPECT_EQ(read_text(folder / "far" / "b"), "new");
    EXPECT_EQ(entries(folder / "far"), 2U);
    std::filesystem::create_symlink("loop", folder / "loop");
    EXPECT_NE(error_of([&] { replace_file(folder / "loop", put_new); }).find("cannot be written"),
              std::string::npos);
}

mode_t mode_of(const std::filesystem::path& file) {
    struct stat about {};
    return stat(file.c_str(), &about) == 0 ? about.st_mode & 07777U : 0;
}

TEST(Files, Replace_AnyMode_IsKept) {
    const testing::TemporaryFolder folder;
    const mode_t mask = umask(022);
    for (const mode_t mode : {0600, 0640, 0644, 0664, 0700}) {
        write(folder / "a", "old");
        ASSERT_EQ(chmod((folder / "a").c_str(), mode), 0);
        replace_file(folder / "a", [&](const std::filesystem::path& temporary) {
            EXPECT_EQ(mode_of(temporary), mode);  // also while it is being written
            put_new(temporary);
        });
        EXPECT_EQ(mode_of(folder / "a"), mode);
        EXPECT_EQ(read_text(folder / "a"), "new");
    }
    umask(027);
    replace_file(folder / "b", put_new);
    EXPECT_EQ(mode_of(folder / "b"), 0640U);
    umask(mask);
}

// Files, and links to a precious one, exist under the names that the temporary file might get.
TEST(Files, Replace_PlantedTemporaries_StayUntouched) {
    const testing::TemporaryFolder folder;
    write(folder / "precious", "kept");
    const std::string stem = "a." + std::to_string(getpid());
    write(folder / (stem + ".part"), "planted");
    std::filesystem::create_symlink("precious", folder / (stem + "-1.part"));
    std::filesystem::create_symlink("missing", folder / (stem + "-2.part"));
    replace_file(folder / "a", put_new);
    EXPECT_EQ(read_text(folder / "a"), "new");
    EXPECT_FALSE(std::filesystem::is_symlink(folder / "a"));
    EXPECT_EQ(read_text(folder / "precious"), "kept");
    EXPECT_EQ(read_text(folder / (stem + ".part")), "planted");
    EXPECT_TRUE(std::filesystem::is_symlink(folder / (stem + "-2.part")));
    EXPECT_FALSE(std::filesystem::exists(folder / "missing"));
    EXPECT_EQ(entries(folder.path()), 5U);
}

TEST(Files, Replace_ADevice_WritesIntoIt) {
    require_replaceable("/dev/null");
    replace_file("/dev/null", put_new);
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
    EXPECT_EQ(error_of([] { replace_file("/dev/full", put_new); }),
              "/dev/full: cannot be written: No space left on device");
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST(Files, Replace_APipe_ReachesWhoReadsItAndNeverWaits) {
    const testing::TemporaryFolder folder;
    ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
    EXPECT_NE(error_of([&] { require_replaceable(folder / "pipe"); }).find("cannot be written"),
              std::string::npos);
    EXPECT_NE(error_of([&] { replace_file(folder / "pipe", put_new); }).find("cannot be written"),
              std::string::npos);
    const int reader = open((folder / "pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    ASSERT_GE(reader, 0);
    // Writers may seek backwards, as those of images do.
    replace_file(folder / "pipe", [](const std::filesystem::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out << "??? words";
        out.seekp(0);
        out << "new";
    });
    std::array<char, 64> got{};
    EXPECT_EQ(read(reader, got.data(), got.size()), 9);
    EXPECT_STREQ(got.data(), "new words");
    close(reader);
    EXPECT_TRUE(std::filesystem::is_fifo(folder / "pipe"));
    EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(Files, SameFile_ByAnyPath_IsRecognised) {
    const testing::TemporaryFolder folder;
    std::filesystem::create_directory(folder / "sub");
    write(folder / "a", "a");
    write(folder / "b", "b");
    std::filesystem::create_symlink("a", folder / "link");
    std::filesystem::create_hard_link(folder / "a", folder / "hard");
    std::filesystem::create_directory_symlink("sub", folder / "other sub");
    std::filesystem::create_symlink("sub/new", folder / "dangling");
    for (const auto& [one, other, same] :
         std::vector<std::tuple<std::string, std::string, bool>>{{"a", "a", true},
                                                                 {"a", "sub/../a", true},
                                                                 {"a", "./a", true},
                                                                 {"a", "link", true},
                                                                 {"a", "hard", true},
                                                                 {"a", "b", false},
                                                                 {"link", "b", false},
                                                                 {"new", "new", true},
                                                                 {"new", "sub/../new", true},
                                                                 {"sub/new", "other sub/new", true},
                                                                 {"sub/new", "dangling", true},
                                                                 {"sub/new", "new", false},
                                                                 {"a", "new", false},
                                                                 {"no folder/x", "no folder/x", true}}) {
        EXPECT_EQ(same_file(folder / one, folder / other), same) << one << " " << other;
        EXPECT_EQ(same_file(folder / other, folder / one), same) << other << " " << one;
    }
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

}  // namespace files_test
}  // namespace lucerna
