// Images of one line, and of up to 65,536 pixels on a side: pixels are computed as usual, and an image that
// does not fit into memory is refused before any work [docs/development/extremes.md].
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "engine/render/render_checks.h"
#include "tests/support/error_of.h"
#include "tests/support/every_light.h"

namespace lucerna {
namespace images_test {

using namespace testing;
using ::testing::AllOf;
using ::testing::HasSubstr;

// Returns a scene with this world: a sky of one colour alone, or a room.
std::string scene(int width, int height, std::string_view world) {
    return fmt::format(
        "Camera \"perspective\" \"float fov\" 45\nFilm \"rgb\" \"integer xresolution\" {} "
        "\"integer yresolution\" {}\nWorldBegin\n{}\n",
        width, height, world);
}
constexpr const char* kSky = "LightSource \"infinite\" \"rgb L\" [0.5 0.25 1]";

class ImageSizes : public ::testing::TestWithParam<Method> {};

TEST_P(ImageSizes, LongAndThin_EveryPixelIsThere) {
    for (const auto& [width, height] :
         {std::pair(16384, 64), std::pair(64, 16384), std::pair(16384, 1), std::pair(1, 16384)}) {
        const Image image = lights().image(scene(width, height, kSky), GetParam(), 1);
        ASSERT_EQ(image.width, width);
        ASSERT_EQ(image.height, height);
        std::size_t other = 0;
        for (std::size_t i = 0; i < image.data.size(); i += image.channels.size()) {
            other += std::fabs(image.data[i] - 0.5F) > 1e-6F ||
                     std::fabs(image.data[i + 1] - 0.25F) > 1e-6F || std::fabs(image.data[i + 2] - 1) > 1e-6F;
        }
        EXPECT_EQ(other, 0U) << width << " x " << height;
    }
}

// Random numbers depend on a pixel's position: also at the far corner of 2^32 pixels.
TEST_P(ImageSizes, ACornerOfAnEnormousImage_IsLitAsTheRest) {
    const std::string text = fmt::format(
        "Camera \"perspective\" \"float fov\" 45\nFilm \"rgb\" \"integer xresolution\" 65536 \"integer "
        "yresolution\" 65536 \"integer pixelbounds\" [65528 65536 65528 65536]\nWorldBegin\n{}\n",
        kSky);
    const Image image = lights().image(text, GetParam(), 4);
    ASSERT_EQ(image.width, 8);
    EXPECT_TRUE(is_finite(image));
    EXPECT_NEAR(image.rgb_at(7, 7).x, 0.5F, 1e-6F);
}

TEST_P(ImageSizes, MoreThanMemoryHolds_IsRefusedBeforeAnyWork) {
    ListeningMonitor monitor;
    const Job job = lights().job(scene(65536, 65536, kSky), GetParam(), 1, monitor);
    const std::string refusal = error_of([&] { render(job, {1, Workers{2}}, monitor); });
    EXPECT_THAT(refusal, AllOf(HasSubstr("65536 x 65536 pixels"), HasSubstr("GB of memory"),
                               HasSubstr("are available"), HasSubstr("cropwindow")));
}

INSTANTIATE_TEST_SUITE_P(Methods, ImageSizes, ::testing::ValuesIn(every_method()), name_of);

TEST(ImageMemory, OfSixteenThousandSquared_IsThatOfItsParts) {
    ListeningMonitor monitor;
    const Job job = lights().job(scene(16384, 16384, kSky), every_method().front(), 1, monitor);
    constexpr std::uint64_t kPixels = std::uint64_t{16384} * 16384;
    EXPECT_EQ(image_memory(job, {}), kPixels * (52 + 24));
    RenderOptions kept;
    kept.keep = [](Checkpoint) {};
    EXPECT_EQ(image_memory(job, kept), kPixels * (52 + 24 + 52));
}

// --- Photons ---

struct Greedy {
    const char* integrator;
    std::vector<std::pair<std::string, std::string>> set;
    const char* named;
};

TEST(PhotonMemory, MoreThanItHolds_IsRefusedAfterAFewPaths) {
    const std::vector<Greedy> all = {
        {"photonmap", {{"photons", "4000000000"}, {"indirect", "map"}, {"direct", "map"}}, "photon maps"},
        {"photonmap", {{"photons", "4000000000"}, {"direct", "gated"}, {"indirect", "none"}}, "guides"},
        {"igi", {{"nlights", "4194304"}, {"nsets", "1024"}}, "virtual point lights"}};
    for (const Greedy& greedy : all) {
        ListeningMonitor monitor;
        const Method method{greedy.named, greedy.integrator, greedy.set};
        const Job job = lights().job(lights().scene(lights().cases().front()), method, 1, monitor);
        const std::string refusal = error_of([&] { render(job, {1, Workers{2}}, monitor); });
        EXPECT_THAT(refusal, AllOf(HasSubstr(greedy.named), HasSubstr("light paths"),
                                   HasSubstr("GB of memory"), HasSubstr("are available")));
    }
}

TEST(PhotonMemory, MorePathsThanHaveNumbers_AreRefused) {
    ListeningMonitor monitor;
    const Method method{"most", "igi", {{"nlights", "16777216"}, {"nsets", "16777216"}}};
    const Job job = lights().job(lights().scene(lights().cases().front()), method, 1, monitor);
    EXPECT_THAT(error_of([&] {
                    render(job, {1, Workers{2}}, monitor);
                }),
                AllOf(HasSubstr("16777216 sets of 16777216 light paths"), HasSubstr("4294967296")));
}

}  // namespace images_test
}  // namespace lucerna
