// Tests steered emission on whole scenes: what the pre-pass learns, and how much the error falls for the same
// number of light paths.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/evaluation/compare.h"
#include "engine/pbrt/read_scene.h"
#include "engine/render/render.h"
#include "tests/support/made_scenes.h"

namespace lucerna {
namespace steered_emission_test {

std::filesystem::path scenes() {
    return std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes";
}

RenderResult rendered(const std::filesystem::path& file, std::string pre_pass, std::string photons,
                      std::uint64_t seed) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = "photonmap";
    // Without probes, whose random choice of photons is noise of its own that emission does not reduce.
    overrides.set = {{"direct", "map"},           {"indirect", "map"},  {"boundary", "none"},
                     {"quantity", "illuminance"}, {"photons", photons}, {"prepass", std::move(pre_pass)}};
    overrides.spp = 4;
    overrides.resolution = V2i(48, 32);
    return render(read_scene(file, overrides, Workers{}, silent), {seed, Workers{}}, silent);
}

// Returns plain error over steered error, for images of 100000 light paths, against a plain image of twenty
// times as many.
double gain(const std::filesystem::path& file) {
    const Image reference = rendered(file, "0", "2000000", 50).image;
    double plain = 0, steered = 0;
    for (const std::uint64_t seed : {1U, 2U}) {
        plain += compare(rendered(file, "0", "100000", seed).image, reference).relative_mse;
        steered += compare(rendered(file, "65536", "100000", seed).image, reference).relative_mse;
    }
    ::testing::Test::RecordProperty("gain", std::to_string(plain / steered));
    return plain / steered;
}

TEST(SteeredEmission, OfRoomsThatAreNotSeen_IsLeftToTheDefensiveWeight) {
    EXPECT_GT(gain(scenes() / "rooms/rooms.pbrt"), 1.5);
    const RenderResult result = rendered(scenes() / "rooms/rooms.pbrt", "65536", "1000", 3);
    EXPECT_GT(result.report.numbers().at("prepass.share_of_lights"), 0.25);
}

TEST(SteeredEmission, OfAMeasuredLamp_PicksTheCellsThatTheCameraSees) {
    EXPECT_GT(gain(testing::made_scenes() / "cloister/beam.pbrt"), 2.5);
}

TEST(Rooms, Flux_IsTheSumOverTheLamps) {
    Monitor silent;
    const Job job = read_scene(scenes() / "rooms/rooms.pbrt", {}, Workers{}, silent);
    ASSERT_EQ(job.scene.lights().size(), 16U);
    double flux = 0;
    for (const auto& light : job.scene.lights()) flux += light->power();
    EXPECT_NEAR(flux, 208.17, 0.05);
}

}  // namespace steered_emission_test
}  // namespace lucerna
