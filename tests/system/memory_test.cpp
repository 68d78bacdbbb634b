// The available memory, and the refusal of work that would need more.
#include "engine/system/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/support/error_of.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace memory_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint64_t kGigabyte = 1'000'000'000;

TEST(Memory, Available_IsMoreThanATestNeedsAndLessThanNoMachineHas) {
    const auto available = available_memory();
    ASSERT_TRUE(available.has_value());
    EXPECT_GT(*available, std::uint64_t{10'000'000});
    EXPECT_LT(*available, std::uint64_t{1} << 50);
}

// Runs in a process of its own, because a limit can only be lowered.
TEST(Memory, Available_IsNoMoreThanTheLimitOfTheProcess) {
    if (testing::kSanitized) GTEST_SKIP() << "the sanitizer has more than the limit";
    const pid_t child = fork();
    if (child == 0) {
        const rlimit limit{std::uint64_t{1} << 36, std::uint64_t{1} << 36};
        setrlimit(RLIMIT_AS, &limit);
        const auto available = available_memory();
        _exit(available && *available < std::uint64_t{1} << 36 ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST(Memory, EnoughOfIt_IsNotRefused) {
    EXPECT_NO_THROW(require_memory(5 * kGigabyte, 5 * kGigabyte, "a thing", ""));
    EXPECT_NO_THROW(require_memory(1, "a thing", ""));
}

TEST(Memory, TooLittleOfIt_IsRefusedWithWhatIsNeededAndWhatThereIs) {
    const std::string refusal = testing::error_of(
        [] { require_memory(18 * kGigabyte, 12 * kGigabyte, "an image of 9 x 9 pixels", "fewer pixels"); });
    EXPECT_THAT(refusal, AllOf(HasSubstr("an image of 9 x 9 pixels"), HasSubstr("needs 18"),
                               HasSubstr("12 GB"), HasSubstr("fewer pixels")));
    EXPECT_THAT(refusal, ::testing::Not(HasSubstr("\n")));
}

// --- control groups, simulated by a folder ---

class Groups : public ::testing::Test {
  protected:
    void write(const std::string& file, const std::string& text) const {
        const std::filesystem::path path = folder_ / file;
        std::filesystem::create_directories(path.parent_path());
        std::ofstream(path) << text;
    }
    // Writes a group of version 2 with its limit and its usage.
    void group(const std::string& folder, const std::string& most, std::uint64_t used) const {
        write(folder + "/memory.max", most + "\n");
        write(folder + "/memory.current", std::to_string(used) + "\n");
    }
    void mount_version2(const std::string& group) const {
        write("proc/self/mountinfo", "22 1 8:1 / / rw - ext4 /dev/sda1 rw\n29 22 0:26 " + group +
                                         " /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw\n");
    }
    std::optional<std::uint64_t> available() const { return available_in_groups(folder_.path()); }

    testing::TemporaryFolder folder_;
};

TEST_F(Groups, NoneAtAll_IsNoLimit) {
    EXPECT_EQ(available(), std::nullopt);
    mount_version2("/");
    write("proc/self/cgroup", "0::/\n");
    EXPECT_EQ(available(), std::nullopt);
    group("sys/fs/cgroup", "max", 5000);
    EXPECT_EQ(available(), std::nullopt);
}

TEST_F(Groups, OfTheProcess_IsTheLimitNotThatOfItsSiblings) {
    mount_version2("/");
    write("proc/self/cgroup", "0::/jobs/mine\n");
    group("sys/fs/cgroup/jobs/mine", "10000", 4000);
    group("sys/fs/cgroup/jobs/other", "10", 9);
    EXPECT_EQ(available(), 6000U);
    write("sys/fs/cgroup/jobs/mine/memory.stat", "anon 1\ninactive_file 500\nactive_file 250\n");
    EXPECT_EQ(available(), 6750U);  // the page cache is reclaimable
}

// Any enclosing group may be the limiting one: the least counts, up to the mount.
TEST_F(Groups, AroundIt_LeaveTheLeast) {
    mount_version2("/");
    write("proc/self/cgroup", "0::/a/b/c\n");
    group("sys/fs/cgroup/a/b/c", "10000", 1000);
    group("sys/fs/cgroup/a/b", "max", 1500);
    EXPECT_EQ(available(), 9000U);
    group("sys/fs/cgroup/a", "3000", 2000);
    EXPECT_EQ(available(), 1000U);
    group("sys/fs/cgroup", "100", 200);
    EXPECT_EQ(available(), 0U);
}

// A container sees its own group at the mount, while the process may still be listed under its outer name.
TEST_F(Groups, MountedFromWithin_AreFoundBelowTheMount) {
    mount_version2("/docker/1234");
    write("proc/self/cgroup", "0::/docker/1234/job\n");
    group("sys/fs/cgroup", "8000", 1000);
    EXPECT_EQ(available(), 7000U);
    group("sys/fs/cgroup/job", "500", 100);
    EXPECT_EQ(available(), 400U);
    write("proc/self/cgroup", "0::/../elsewhere\n");  // in another namespace only the mount is visible
    EXPECT_EQ(available(), 7000U);
}

TEST_F(Groups, OfVersion1_CountTheirChildren) {
    write("proc/self/mountinfo",
          "30 22 0:27 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu,cpuacct\n"
          "31 22 0:28 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n");
    write("proc/self/cgroup", "4:cpu,cpuacct:/cpu-only\n3:memory:/jobs/mine\n");
    write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
    write("sys/fs/cgroup/memory/memory.usage_in_bytes", "123456\n");
    write("sys/fs/cgroup/memory/jobs/memory.limit_in_bytes", "9000\n");
    write("sys/fs/cgroup/memory/jobs/memory.usage_in_bytes", "7000\n");
    write("sys/fs/cgroup/memory/jobs/memory.stat",
          "inactive_file 1\ntotal_inactive_file 600\ntotal_active_file 30\n");
    write("sys/fs/cgroup/memory/jobs/mine/memory.limit_in_bytes", "5000\n");
    write("sys/fs/cgroup/memory/jobs/mine/memory.usage_in_bytes", "100\n");
    EXPECT_EQ(available(), 2630U);
}

TEST(Memory, BytesOf_NeverWrapsRound) {
    EXPECT_EQ(bytes_of(3, 4), 12U);
    EXPECT_EQ(bytes_of(7, 0), 0U);
    EXPECT_EQ(bytes_of(std::uint64_t{1} << 60, 16), std::numeric_limits<std::uint64_t>::max());
    EXPECT_THROW(require_memory(bytes_of(std::uint64_t{1} << 60, 16), "a thing", ""), InputError);
}

// Allocates many small pieces in a process that is limited to 1 GiB.
TEST(Memory, Watch_StopsWhatGrowsByPieces) {
    if (testing::kSanitized) GTEST_SKIP() << "the sanitizer has more than the limit";
    const pid_t child = fork();
    if (child == 0) {
        rlimit limit{std::uint64_t{1} << 30, std::uint64_t{1} << 30};
        setrlimit(RLIMIT_AS, &limit);
        std::vector<std::unique_ptr<std::array<char, 4096>>> pieces;
        MemoryWatch watch("pieces", "fewer");
        try {
            for (int i = 0; i < 1 << 20; ++i) {
                watch.add(4096);
                pieces.push_back(std::make_unique<std::array<char, 4096>>());
            }
        } catch (const InputError&) {
            _exit(0);
        } catch (const std::bad_alloc&) {
            _exit(2);
        }
        _exit(1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace memory_test
}  // namespace lucerna
