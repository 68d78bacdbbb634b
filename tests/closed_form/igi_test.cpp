// Tests light that VPLs alone lack and compensation adds: by mirrors and glass, from surfaces that are not
// Lambertian, through translucent ones; and VPLs from a measured lamp.
#include <gtest/gtest.h>

#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace igi_test {

using testing::all_but_the_lamp;
using testing::compare_means;
using testing::expect_agrees;
using testing::expect_differs;
using testing::few_lights;
using testing::region_means;
using testing::RegionMeans;
using testing::SceneMaker;

bool lower_half(double, double y) {
    return y < 0;
}

constexpr int kSets = 2048;

RegionMeans means(Scene scene, const IntegratorSettings& settings, int spp, int seeds = 8) {
    const Job job = testing::make_job(std::move(scene), testing::small_cornell_camera(16), settings, spp);
    return region_means(job, seeds, all_but_the_lamp, lower_half);
}

Scene room_with_mirror_and_glass() {
    return testing::small_cornell_with([](SceneMaker& make) {
        make.quad({0.02F, 0.1F, 0.2F}, {0, 0.8F, 0}, {0, 0, 0.6F}, make.material(MirrorMaterial{}));
        make.sphere({0.3F, 0.2F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    });
}

TEST(IgiCompensation, ByWayOfMirrorsAndGlass_AgreesWithPath) {
    const RegionMeans path = means(room_with_mirror_and_glass(), PathSettings{}, 2048);
    IgiSettings igi = few_lights(0.05F, kSets);
    expect_agrees(means(room_with_mirror_and_glass(), igi, 64), path, "all, by photons", 0.006);
    igi.caustic_paths = 0;
    expect_agrees(means(room_with_mirror_and_glass(), igi, 512), path, "all, by rays", 0.006);
    // Compensation and the Caustic map each contribute to the light.
    igi.gather_samples = 0;
    const auto without_either = means(room_with_mirror_and_glass(), igi, 64);
    igi.caustic_paths = IgiSettings{}.caustic_paths;
    const auto without_rays = means(room_with_mirror_and_glass(), igi, 64);
    EXPECT_LT(compare_means(without_rays.part, path.part).ratio, 0.99);
    EXPECT_LT(compare_means(without_either.part, without_rays.part).ratio, 0.98);
}

// Returns the variance between renders of other seeds, averaged over the pixels of `where`.
double variance_of_pixels(const Job& job, const testing::Where& where) {
    constexpr int kSeeds = 8;
    Monitor silent;
    std::vector<RunningStats> pixels;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        const Image image = render(job, {seed, Workers{2}}, silent).image;
        pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const int x = static_cast<int>(i) % image.width, y = static_cast<int>(i) / image.width;
            if (!where((2 * x + 1.0) / image.width - 1, 1 - (2 * y + 1.0) / image.height)) continue;
            pixels[i].add(double{luminance(image.rgb_at(x, y))});
        }
    }
    RunningStats all;
    for (const RunningStats& pixel : pixels) {
        if (pixel.count() > 0) all.add(pixel.variance());
    }
    return all.mean();
}

// Walls see the bright caustic of a glass ball through the ball and by reflection in it. Rays from the walls
// rarely meet it, which would cause fireflies.
TEST(IgiCompensation, CausticsSeenByWayOfGlass_MakeNoSpecks) {
    const auto upper_half = [](double x, double y) { return y > 0 && all_but_the_lamp(x, y); };
    IgiSettings igi = few_lights(0.05F, 256);
    igi.nlights = 64;
    igi.caustic_paths = 200'000;
    const auto variance = [&](void (*add)(SceneMaker&)) {
        const Job job =
            testing::make_job(testing::small_cornell_with(add), testing::small_cornell_camera(24), igi, 16);
        return variance_of_pixels(job, upper_half);
    };
    const double with = variance([](SceneMaker& make) {
        make.sphere({0.3F, 0.2F, 0.3F}, 0.18F, make.material(DielectricMaterial{}));
    });
    const double without = variance([](SceneMaker& make) {
        make.sphere({0.3F, 0.2F, 0.3F}, 0.18F, make.diffuse(Rgb(0.5F)));
    });
    std::printf("variance with caustics %.3g, without %.3g\n", with, without);
    EXPECT_LT(with, 1.5 * without);
}

// Where rays compensate, no VPL represents gloss: the result is the path tracer's at any least distance.
TEST(IgiCompensation, OnGloss_AtAnyLeastDistance_AgreesWithPath) {
    const auto glossy = [] {
        return testing::small_cornell_with([](SceneMaker& make) {
            ConductorMaterial metal;
            metal.roughness = Roughness::of_alpha(0.2F);
            make.quad({0.02F, 0.1F, 0.2F}, {0, 0.8F, 0}, {0, 0, 0.6F}, make.material(metal));
        });
    };
    const RegionMeans path = means(glossy(), PathSettings{}, 1024);
    IgiSettings igi = few_lights(0.05F, kSets);
    expect_agrees(means(glossy(), igi, 64), path, "by photons", 0.006);
    igi.caustic_paths = 0;
    expect_agrees(means(glossy(), igi, 512), path, "by rays", 0.006);
    igi.mindist = 10;
    expect_agrees(means(glossy(), igi, 512), path, "by rays, all compensated", 0.006);
}

// Returns a room with a lamp behind a curtain: all light in the room passes through it.
Scene room_behind_a_curtain() {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.7F));
    make.room({1, 1, 2}, white);
    DiffuseTransmissionMaterial curtain;
    curtain.reflectance = RgbTexture::constant(Rgb(0.2F));
    curtain.transmittance = RgbTexture::constant(Rgb(0.6F));
    make.quad({0, 0, 1.5F}, {1, 0, 0}, {0, 1, 0}, make.material(curtain));
    make.light(make_point_light(V3f(0.5F, 0.5F, 1.75F), Rgb(1.0F)));
    return make.build();
}

TEST(IgiOfACurtain, LightOnTheOtherSide_AgreesWithPath) {
    const auto seen = [](const IntegratorSettings& settings, int spp) {
        const Camera camera = testing::camera({0.4F, 0.5F, 0.2F}, {0.6F, 0.3F, 1.5F}, 16, 16, 70);
        return region_means(
            testing::make_job(room_behind_a_curtain(), camera, settings, spp), 8,
            [](double, double) { return true; }, lower_half);
    };
    const RegionMeans path = seen(PathSettings{}, 512);
    for (const float mindist : {0.05F, 0.4F}) {
        expect_agrees(seen(few_lights(mindist, kSets), 64), path, fmt::format("mindist {}", mindist), 0.006);
    }
}

Scene room_of_a_measured_lamp() {
    SceneMaker make;
    Monitor silent;
    const LightField field = testing::lambertian_disc(testing::rig_a(), 0.01);
    MeasuredSettings settings;
    settings.power = 3;
    settings.world_from_light = M44d().translate(V3d(0.5, 0.5, 0.3));
    make.room({1, 1, 1}, make.diffuse(Rgb(0.7F)));
    make.light(make_measured_light(field, CellTable(field, {1}, silent), settings, silent));
    return make.build();
}

TEST(IgiOfAMeasuredLamp, InAClosedRoom_AgreesWithPathAtAnyLeastDistance) {
    const auto seen = [](IntegratorSettings settings, int spp) {
        std::visit([](auto& s) { s.quantity = Quantity::illuminance; }, settings);
        const Camera camera = testing::camera({0.5F, 0.4F, 0.05F}, {0.9F, 0.5F, 0.3F}, 16, 16, 80);
        return region_means(
            testing::make_job(room_of_a_measured_lamp(), camera, settings, spp), 8,
            [](double, double) { return true; }, lower_half);
    };
    const RegionMeans path = seen(PathSettings{}, 512);
    for (const float mindist : {1e-6F, 0.09F, 0.35F}) {
        expect_agrees(seen(few_lights(mindist, kSets), 64), path, fmt::format("mindist {}", mindist), 0.011);
    }
    IgiSettings bare = few_lights(0.35F, kSets);
    bare.gather_samples = 0;
    expect_differs(seen(bare, 64), path, "not compensated");
}

}  // namespace igi_test
}  // namespace lucerna
