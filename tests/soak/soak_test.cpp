// The largest of the extremes, run manually: ctest -L soak. Each test states its memory and skips if there is
// less. The built command runs in its own process, whose peak memory the system reports.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "engine/image/image.h"
#include "engine/system/memory.h"
#include "engine/text/units.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace soak_test {

// The command's exit code, and its peak resident memory in bytes.
struct Ran {
    int code;
    double bytes;
};
Ran run(const std::filesystem::path& folder, std::vector<std::string> words) {
    words.insert(words.begin(), LUCERNA_COMMAND);
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const pid_t child = fork();
    if (child == 0) {
        if (chdir(folder.c_str()) == 0) execv(argv[0], argv.data());
        _exit(127);
    }
    int status = 0;
    rusage usage{};
    wait4(child, &status, 0, &usage);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
            1024.0 * static_cast<double>(usage.ru_maxrss)};
}

bool enough_memory(double bytes) {
    return static_cast<double>(available_memory().value_or(0)) > bytes;
}

// The film's sums take 52 bytes and the image 24, plus some for writing.
TEST(Soak, ImageOfSixteenThousandSquared_TakesSeventySixBytesForAPixel) {
    constexpr double kPixels = 16384.0 * 16384, kBytes = 76 * kPixels;
    if (!enough_memory(1.05 * kBytes)) GTEST_SKIP() << "needs " << bytes_text(1.05 * kBytes) << " of memory";
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "sky.pbrt") << "Camera \"perspective\" WorldBegin\n"
                                          "LightSource \"infinite\" \"rgb L\" [0.5 0.25 1]\n";
    const Ran ran = run(folder.path(), {"render", "sky.pbrt", "-o", "sky.exr", "--resolution", "16384x16384",
                                        "--spp", "1", "--integrator", "direct"});
    ASSERT_EQ(ran.code, 0);
    EXPECT_LT(ran.bytes, 1.05 * kBytes);
    RecordProperty("peak_memory", bytes_text(ran.bytes));
    const Image image = read_exr(folder / "sky.exr");
    ASSERT_EQ(image.width, 16384);
    for (const int at : {0, 8191, 16383}) EXPECT_NEAR(image.rgb_at(at, at).y, 0.25F, 1e-6F);
}

// A room is open at one side; each of a point light's paths stores some 0.85 photons of 142 bytes.
TEST(Soak, AHundredMillionLightPaths_ShowTheRoomThatAMillionShow) {
    constexpr double kPaths = 1e8, kBytes = 0.85 * kPaths * 142;
    if (!enough_memory(1.1 * kBytes)) GTEST_SKIP() << "needs " << bytes_text(1.1 * kBytes) << " of memory";
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "room.pbrt") << R"(
LookAt 0.1 0.1 -2.6  0 -0.1 0  0 1 0
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 24 "integer yresolution" 24
WorldBegin
LightSource "point" "point3 from" [0.5 0.8 -0.4] "rgb I" [1 0.9 0.8]
Material "diffuse" "rgb reflectance" [0.6 0.5 0.4]
Shape "trianglemesh" "point3 P" [-1 -1 -1  1 -1 -1  1 -1 1  -1 -1 1] "integer indices" [0 2 1 0 3 2]
Shape "trianglemesh" "point3 P" [-1 1 -1  1 1 -1  1 1 1  -1 1 1] "integer indices" [0 1 2 0 2 3]
Shape "trianglemesh" "point3 P" [-1 -1 1  1 -1 1  1 1 1  -1 1 1] "integer indices" [0 2 1 0 3 2]
Shape "trianglemesh" "point3 P" [-1 -1 -1  -1 1 -1  -1 1 1  -1 -1 1] "integer indices" [0 1 2 0 2 3]
)";
    const auto words = [](const std::string& name, const std::string& photons, const std::string& k) {
        return std::vector<std::string>{"render",       "room.pbrt",          "-o",    name + ".exr",
                                        "--integrator", "photonmap",          "--spp", "16",
                                        "--set",        "direct=map",         "--set", "indirect=map",
                                        "--set",        "photons=" + photons, "--set", "k=" + k,
                                        "--stats",      name + ".json"};
    };
    ASSERT_EQ(run(folder.path(), words("few", "1000000", "1000")).code, 0);
    const Ran ran = run(folder.path(), words("many", "100000000", "1000"));
    ASSERT_EQ(ran.code, 0);
    RecordProperty("peak_memory", bytes_text(ran.bytes));
    EXPECT_LT(ran.bytes, 1.1 * kBytes);
    const auto mean = [&](const char* name) {
        const Image image = read_exr(folder / name);
        double sum = 0;
        for (int y = 0; y < image.height; ++y) {
            for (int x = 0; x < image.width; ++x) sum += double{luminance(image.rgb_at(x, y))};
        }
        return sum;
    };
    EXPECT_NEAR(mean("many.exr") / mean("few.exr"), 1, 0.02);
    std::ifstream stats(folder / "many.json");
    const nlohmann::json numbers = nlohmann::json::parse(stats)["numbers"];
    EXPECT_GT(numbers["photons.direct.stored"].get<double>() + numbers["photons.global.stored"].get<double>(),
              8e7);
}

}  // namespace soak_test
}  // namespace lucerna
