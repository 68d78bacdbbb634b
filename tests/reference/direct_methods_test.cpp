// Direct light by photons, and by the light tree, on whole scenes beside the plain way.
#include <gtest/gtest.h>

#include <cmath>

#include "engine/pbrt/read_scene.h"
#include "engine/render/compare.h"
#include "engine/render/render.h"

namespace lucerna {
namespace {

using Parameters = std::vector<std::pair<std::string, std::string>>;

struct Case {
    const char* name;
    const char* file;
    const char* needs;  // a made file without which the test skips
};
constexpr Case kCases[] = {
    {"flashlight", "cloister/by-flashlight.pbrt", "lamps/flashlight/flashlight.exr"},
    {"projector", "cloister/by-projector.pbrt", "lamps/projector/projector.exr"},
    {"many lights", "many-lights/many-lights.pbrt", ""},
    {"one large light", "cornell/cornell.pbrt", ""},
};

std::filesystem::path scenes() {
    return std::filesystem::path(LUCERNA_SOURCE_DIR) / "scenes";
}

bool made(const Case& c) {
    const bool cloister = std::string_view(c.file).starts_with("cloister");
    return std::filesystem::exists(scenes() / c.needs) &&
           (!cloister || std::filesystem::exists(scenes() / "cloister/mesh"));
}

Image rendered(const Case& c, const std::string& integrator, const Parameters& parameters, int spp,
               std::uint64_t seed) {
    Monitor silent;
    SceneOverrides overrides;
    overrides.integrator = integrator;
    overrides.set = parameters;
    overrides.spp = spp;
    overrides.resolution = V2i(48, 32);
    const Job job = read_scene(scenes() / c.file, overrides, Workers{}, silent);
    return render(job, {seed, Workers{}}, silent).image;
}

// How many standard deviations the sums of two images lie apart, over the pixels x0 <= x < x1 of every row.
double sigmas_apart(const Image& a, const Image& b, int x0, int x1) {
    double difference = 0, variance = 0;
    for (int y = 0; y < a.height; ++y) {
        for (int x = x0; x < x1; ++x) {
            for (int c = 0; c < 3; ++c) {
                difference += double{a.value(x, y, c)} - double{b.value(x, y, c)};
                variance += double{a.value(x, y, 3 + c)} + double{b.value(x, y, 3 + c)};
            }
        }
    }
    // The channels of a sample rise and fall together: the sum of three has up to three times the variance.
    return difference / std::sqrt(3 * variance);
}

void expect_unbiased(const Case& c, const Parameters& parameters, int spp) {
    // What is lit, not the lamps themselves: a few of them in a pixel are most of a picture's noise.
    const Image plain =
        rendered(c, "direct", {{"quantity", "illuminance"}, {"lights", "power"}}, 32 * spp, 1);
    Parameters all = parameters;
    all.emplace_back("quantity", "illuminance");
    const Image tried = rendered(c, "photonmap", all, spp, 2);
    for (int x = 0; x < 48; x += 16) {
        EXPECT_LT(std::fabs(sigmas_apart(tried, plain, x, x + 16)), 4) << c.name << " from column " << x;
    }
    for (const ChannelComparison& channel : compare(tried, plain).channels) {
        EXPECT_NEAR(channel.ratio.value_or(0), 1, 0.02) << c.name;
    }
    // The test sees 5 % too much.
    Image wrong = tried;
    for (int y = 0; y < wrong.height; ++y) {
        for (int x = 0; x < wrong.width; ++x) wrong.set_rgb(x, y, wrong.rgb_at(x, y) * 1.05F);
    }
    EXPECT_GT(sigmas_apart(wrong, plain, 0, 48), 4) << c.name;
}

TEST(DirectMethods, Guided_IsUnbiasedOnWholeScenes) {
    int tested = 0;
    for (const Case& c : kCases) {
        if (!made(c)) {
            std::cout << c.name << " left out: bench/figures/direct_methods.sh makes what it needs\n";
            continue;
        }
        expect_unbiased(c, {{"direct", "guided"}, {"indirect", "none"}}, 128);
        expect_unbiased(c, {{"direct", "guided"}, {"indirect", "none"}, {"guidephotons", "100"}}, 128);
        ++tested;
    }
    EXPECT_GE(tested, 2);
}

// The other scenes have a light or two: nothing to choose.
TEST(DirectMethods, LightTree_IsUnbiasedWhereThereAreManyLights) {
    expect_unbiased(kCases[2], {{"direct", "mc"}, {"indirect", "none"}, {"lights", "tree"}}, 512);
}

TEST(ManyLights, Flux_IsTheSumOverTheBalls) {
    Monitor silent;
    const Job job = read_scene(scenes() / "many-lights/many-lights.pbrt", {}, Workers{}, silent);
    ASSERT_EQ(job.scene.lights().size(), 384U);
    double flux = 0;
    for (const auto& light : job.scene.lights()) flux += light->power();
    EXPECT_NEAR(flux, 2453.93, 0.05);
}

}  // namespace
}  // namespace lucerna
