// Arbitrary bytes give a scene or one line that says what is wrong, never a crash, a hang or a silently
// truncated scene.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/support/sanitized.h"
#include "tests/support/scene_text.h"

namespace lucerna {
namespace garbage_test {

using namespace lucerna::testing;

constexpr std::string_view kSample =
    "LookAt 0 1 5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 40 ]\n"
    "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8\nIntegrator \"photonmap\" \"integer "
    "k\" 20\n"
    "WorldBegin\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] # light\n"
    "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 1 1 0 ] \"integer indices\" [ 0 1 2 ]\nAttributeEnd\n"
    "Texture \"t\" \"spectrum\" \"checkerboard\" \"float uscale\" 4\nMaterial \"matte\" \"texture Kd\" "
    "\"t\"\n"
    "Translate 1 2 3 Rotate 30 0 1 0 Shape \"sphere\" \"float radius\" 0.5\nWorldEnd\n";

// Returns true if the text is read; a refusal must be one line that starts with the file's name.
bool read_or_refuse(const std::string& text) {
    const std::string message = refusal_of_file(text);
    EXPECT_TRUE(message.empty() || message.starts_with("scene.pbrt") || message.starts_with("--")) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const char c : message) EXPECT_TRUE(c >= 0x20 && c < 0x7f) << message;
    return message.empty();
}

TEST(Garbage, RandomBytes_AreRefused) {
    std::mt19937 random(1);
    std::string bytes(1 << 20, '\0');
    for (char& c : bytes) c = static_cast<char>(random() & 255U);
    EXPECT_FALSE(read_or_refuse(bytes));
    EXPECT_FALSE(read_or_refuse(std::string(1 << 20, '[')));
    EXPECT_FALSE(read_or_refuse(std::string(1 << 20, '"')));
    EXPECT_FALSE(read_or_refuse(std::string(1 << 20, '\0')));
    EXPECT_FALSE(read_or_refuse(std::string(1 << 20, '\n')));
}

TEST(Garbage, EveryTruncation_IsReadOrRefused) {
    EXPECT_TRUE(read_or_refuse(std::string(kSample)));
    for (std::size_t length = 0; length < kSample.size(); ++length) {
        read_or_refuse(std::string(kSample.substr(0, length)));
    }
}

TEST(Garbage, MutatedScenes_AreReadOrRefused) {
    std::mt19937 random(2);
    const auto pick = [&](std::size_t n) {
        return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
    };
    constexpr std::string_view spice = "\"[]#-+.e09 \n\\Ax";
    int read = 0;
    for (int round = 0; round < 20'000; ++round) {
        std::string text(kSample);
        for (std::size_t edits = 1 + pick(4); edits > 0; --edits) {
            const std::size_t at = pick(text.size());
            switch (pick(4)) {
                case 0:
                    text[at] = spice[pick(spice.size())];
                    break;
                case 1:
                    text.erase(at, 1 + pick(12));
                    break;
                case 2:
                    text.insert(at, 1, spice[pick(spice.size())]);
                    break;
                default:
                    text.insert(at, text.substr(pick(text.size()), pick(40)));
                    break;
            }
            if (text.empty()) text.push_back(' ');
        }
        read += read_or_refuse(text) ? 1 : 0;
    }
    EXPECT_GT(read, 300) << "mutations that leave the scene whole must still be read";
}

TEST(Garbage, FuzzersCorpus_IsReadOrRefused) {
    int files = 0;
    const std::filesystem::path corpus = std::filesystem::path(LUCERNA_SOURCE_DIR) / "tests/fuzz/corpus/pbrt";
    for (const auto& entry : std::filesystem::directory_iterator(corpus)) {
        std::ifstream in(entry.path(), std::ios::binary);
        read_or_refuse(std::string(std::istreambuf_iterator<char>(in), {}));
        ++files;
    }
    EXPECT_GE(files, 10);
}

// Large meshes make up most of real scene files.
TEST(Garbage, LargeMesh_IsReadFast) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-100, 100);
    std::string text = std::string(kHead) + "Shape \"trianglemesh\" \"point3 P\" [";
    const int vertices = 400'000;
    for (int i = 0; i < vertices; ++i) {
        text += fmt::format("{:.6f} {:.6f} {:.6f}\n", uniform(random), uniform(random), uniform(random));
    }
    text += "] \"integer indices\" [";
    for (int i = 0; i + 2 < vertices; ++i) text += fmt::format("{} {} {}\n", i, i + 1, i + 2);
    text += "]";
    const auto start = std::chrono::steady_clock::now();
    const Read read = read_file_text(text);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const double rate = static_cast<double>(text.size()) / 1e6 / seconds.count();
    RecordProperty("MB_per_second", std::to_string(rate));
    EXPECT_EQ(read.draft.meshes.at(0).p.size(), static_cast<std::size_t>(vertices));
#if defined(__OPTIMIZE__) && !defined(LUCERNA_TRAPS)
    if (!testing::kSanitized) {
        EXPECT_GT(rate, 10) << "the aim is 50 MB/s on an idle core";
    }
#endif
}

}  // namespace garbage_test
}  // namespace lucerna
