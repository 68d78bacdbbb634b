// What memory there is, and the refusal of what would need more.
#include "engine/base/memory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/error_of.h"
#include "tests/support/sanitized.h"

namespace lucerna {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::uint64_t kGigabyte = 1'000'000'000;

TEST(Memory, Available_IsMoreThanATestNeedsAndLessThanNoMachineHas) {
    const auto available = available_memory();
    ASSERT_TRUE(available.has_value());
    EXPECT_GT(*available, std::uint64_t{10'000'000});
    EXPECT_LT(*available, std::uint64_t{1} << 50);
}

// In a process of its own, as a limit can only fall.
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

}  // namespace
}  // namespace lucerna
