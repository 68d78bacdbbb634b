// An image takes the predicted amount of memory; with less, the command refuses before any work.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <string>
#include <vector>

#include "engine/system/files.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace memory_test {

struct Ran {
    int code;
    double bytes;  // peak resident memory
};

class ImageInMemory : public ::testing::Test {
  protected:
    void SetUp() override {
        if (testing::kSanitized) GTEST_SKIP() << "sanitizers take memory of their own";
        std::ofstream(folder_ / "sky.pbrt")
            << "Camera \"perspective\" Film \"rgb\" WorldBegin LightSource \"infinite\"\n"
               "Shape \"sphere\" \"float radius\" 0.1\n";  // a scene without shapes gives an additional
                                                           // warning
    }

    // `limit` is that of the address space in bytes; 0: none.
    Ran render(const std::string& resolution, std::uint64_t limit = 0) const {
        std::vector<std::string> words{LUCERNA_COMMAND, "render",    "sky.pbrt", "-o",     "sky.exr",
                                       "--resolution",  resolution,  "--spp",    "1",      "--integrator",
                                       "direct",        "--threads", "2",        "--quiet"};
        std::vector<char*> argv;
        for (std::string& word : words) argv.push_back(word.data());
        argv.push_back(nullptr);
        const pid_t child = fork();
        if (child == 0) {
            const rlimit most{limit, limit};
            if (limit > 0) setrlimit(RLIMIT_AS, &most);
            const std::string errors = folder_ / "errors";
            if (chdir(folder_.path().c_str()) == 0 && freopen(errors.c_str(), "w", stderr) != nullptr)
                execv(argv[0], argv.data());
            _exit(127);
        }
        int status = 0;
        rusage usage{};
        wait4(child, &status, 0, &usage);
        return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
                1024.0 * static_cast<double>(usage.ru_maxrss)};
    }

    testing::TemporaryFolder folder_;
};

TEST_F(ImageInMemory, Largest_IsWhatIsForetold) {
    const Ran small = render("16x16"), large = render("4096x1024");
    ASSERT_EQ(small.code, 0);
    ASSERT_EQ(large.code, 0);
    const double each = (large.bytes - small.bytes) / (4096.0 * 1024);
    RecordProperty("bytes_per_pixel", std::to_string(each));
    EXPECT_GT(each, 0.9 * 76);  // docs/development/extremes.md
    EXPECT_LT(each, 1.1 * 76);
}

TEST_F(ImageInMemory, MoreThanTheProcessMayHave_IsOneLineAndTheOldImageStays) {
    std::ofstream(folder_ / "sky.exr") << "old";
    const Ran ran = render("8192x8192", std::uint64_t{3} << 30);  // 5.1 GB
    EXPECT_EQ(ran.code, 1);
    EXPECT_LT(ran.bytes, 3e8) << "it began";
    const std::string said = read_text(folder_ / "errors");
    EXPECT_NE(said.find("8192 x 8192 pixels: needs 5.1 GB"), said.npos) << said;
    EXPECT_EQ(said.find('\n'), said.size() - 1) << said;
    EXPECT_EQ(read_text(folder_ / "sky.exr"), "old");
}

// Libraries set up threads, devices and tables with the first memory they get. Wherever the limit falls, the
// error blames the machine, in one line.
TEST_F(ImageInMemory, AnyLimit_IsNoFaultOfOurs) {
    int refused = 0, done = 0;
    for (std::uint64_t limit = std::uint64_t{64} << 20; limit < std::uint64_t{1} << 30;
         limit += std::uint64_t{24} << 20) {
        const Ran ran = render("16x16", limit);
        const std::string said =
            std::filesystem::file_size(folder_ / "errors") > 0 ? read_text(folder_ / "errors") : "";
        if (ran.code == 127) continue;  // the loader itself has no memory for the program
        EXPECT_TRUE(ran.code == 0 || ran.code == 1)
            << ran.code << " with " << (limit >> 20) << " MB: " << said;
        EXPECT_EQ(said.find("fault"), said.npos) << said;
        if (ran.code == 1) {
            EXPECT_EQ(said.find('\n'), said.size() - 1) << said;
        }
        ran.code == 0 ? ++done : ++refused;
    }
    EXPECT_GT(done, 0);
    EXPECT_GT(refused, 0);
}

}  // namespace memory_test
}  // namespace lucerna
