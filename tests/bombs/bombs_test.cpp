// Small inputs that require excessive stack, time or memory: the built command refuses each in one line, with
// 2 GiB of address space, a stack of 8 MiB and 6 s of processor time.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>

#include "engine/system/files.h"
#include "tests/bombs/bomb.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace {

using namespace testing;
using ::testing::HasSubstr;

constexpr rlim_t kAddresses = rlim_t{2} << 30, kStack = rlim_t{8} << 20;
// Seconds of processor time, independent of the machine's load: at most one on a current machine, several on
// a slow one. An input that is not refused takes minutes or never ends. A sanitized build takes many times as
// long.
constexpr double kMostSeconds = kSanitized ? 60 : 6;
constexpr rlim_t kHang = kSanitized ? 120 : 20;

struct Ended {
    int code = 0;    // 128 + the signal if one ended the command
    double seconds;  // of all processors
    std::string errors;
};

void limit(int what, rlim_t most) {
    const rlimit limits{most, most};
    setrlimit(what, &limits);
}

[[noreturn]] void be_the_command(std::vector<std::string> words, const std::filesystem::path& folder) {
    words.insert(words.begin(), LUCERNA_COMMAND);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    if (chdir(folder.c_str()) != 0) _exit(126);
    const int out = open("said", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int errors = open("errors", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(out, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_CPU, kHang);
    limit(RLIMIT_STACK, kStack);
    if (!kSanitized) limit(RLIMIT_AS, kAddresses);  // a sanitizer reserves more
    execv(argv[0], argv.data());
    _exit(127);
}

Ended run(const std::vector<std::string>& words, const std::filesystem::path& folder) {
    const pid_t child = fork();
    if (child == 0) be_the_command(words, folder);
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    const auto seconds = [](const timeval& t) {
        return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    Ended ended{WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status),
                seconds(usage.ru_utime) + seconds(usage.ru_stime),
                {}};
    if (std::filesystem::file_size(folder / "errors") > 0) ended.errors = read_text(folder / "errors");
    return ended;
}

std::vector<Bomb> every_bomb() {
    std::vector<Bomb> all = deep_bombs();
    for (const auto& more : {growing_bombs(), lying_bombs()}) all.insert(all.end(), more.begin(), more.end());
    return all;
}

class BombTest : public ::testing::TestWithParam<Bomb> {};

TEST_P(BombTest, IsRefusedInOneLineOrDoneAtOnce) {
    const TemporaryFolder folder;
    const Bomb& bomb = GetParam();
    bomb.make(folder.path());
    const Ended ended = run(bomb.words, folder.path());
    EXPECT_LT(ended.seconds, kMostSeconds);
    const std::string errors = ended.errors.substr(0, 2000);
    for (const std::string& mention : bomb.mentions) EXPECT_THAT(errors, HasSubstr(mention));
    const auto lines = std::count(ended.errors.begin(), ended.errors.end(), '\n');
    if (bomb.end == Bomb::End::rendered) {
        constexpr std::ptrdiff_t kFewWarnings = 8;  // identical warnings are counted
        EXPECT_EQ(ended.code, 0) << errors;
        EXPECT_LE(lines, kFewWarnings) << errors;
        return;
    }
    EXPECT_EQ(ended.code, 1) << errors;
    EXPECT_EQ(lines, 1) << errors;
    EXPECT_THAT(errors, ::testing::StartsWith("lucerna: "));
    EXPECT_LT(ended.errors.size(), 1000U) << "a line that nobody reads";
}

INSTANTIATE_TEST_SUITE_P(Bombs, BombTest, ::testing::ValuesIn(every_bomb()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace lucerna
