// Tests steered emission in the integrators: when it is used, and that it preserves the mean.
#include <gtest/gtest.h>

#include "tests/support/same_image.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace steering_test {

using testing::same;

using testing::SceneMaker;

// Returns the small Cornell box with a lamp behind its back wall, invisible to the camera.
Scene box_with_a_lamp_behind() {
    return testing::small_cornell_with([](SceneMaker& make) {
        const auto white = make.diffuse(Rgb(0.7F));
        make.quad({0, 0, 2}, {0, 1, 0}, {1, 0, 0}, white);
        make.quad({0, 0, 1.01F}, {1, 0, 0}, {0, 1, 0}, white);
        make.light(make_point_light({0.5F, 0.5F, 1.5F}, Rgb(0.8F)));
    });
}

PhotonMapSettings maps_seen_directly() {
    PhotonMapSettings settings;
    settings.photons = 20'000;
    settings.direct = DirectMethod::map;
    settings.indirect = IndirectMethod::map;
    settings.pre_pass = 8192;
    return settings;
}

RenderResult picture(const IntegratorSettings& settings, RenderOptions options = {}, int size = 16,
                     int spp = 2) {
    Monitor silent;
    return render(
        testing::make_job(box_with_a_lamp_behind(), testing::small_cornell_camera(size), settings, spp),
        options, silent);
}

TEST(SteeredEmission, OnOrOff_IsReported) {
    PhotonMapSettings settings = maps_seen_directly();
    const RenderResult steered = picture(settings);
    EXPECT_EQ(steered.report.notes().at("emission"), "steered by an importance pre-pass");
    EXPECT_GT(steered.report.numbers().at("prepass.blocks"), 2);
    settings.pre_pass = 0;
    const RenderResult plain = picture(settings);
    EXPECT_EQ(plain.report.notes().at("emission"), "plain: prepass = 0");
    EXPECT_FALSE(same(steered.image, plain.image));
    EXPECT_GT(steered.report.numbers().at("prepass.share_of_lights"), 0.1);
}

TEST(SteeredEmission, OnAnyNumberOfThreads_IsTheSameImage) {
    RenderOptions one, three;
    one.workers = {1};
    three.workers = {3};
    EXPECT_TRUE(same(picture(maps_seen_directly(), one).image, picture(maps_seen_directly(), three).image));
    ProgressiveSettings passes;
    passes.photons = 5000;
    passes.pre_pass = 8192;
    EXPECT_TRUE(same(picture(passes, one).image, picture(passes, three).image));
}

TEST(SteeredEmission, OfMapsInFiles_IsPlain) {
    const testing::TemporaryFolder folder;
    RenderOptions save;
    save.maps.save = folder / "maps.photons";
    const RenderResult saved = picture(maps_seen_directly(), save);
    EXPECT_EQ(saved.report.notes().at("emission"), "plain: maps in files serve every camera");
    RenderOptions load;
    load.maps.load = folder / "maps.photons";
    EXPECT_TRUE(same(saved.image, picture(maps_seen_directly(), load).image));
}

TEST(SteeredEmission, EnergyBalances_AndItsMeanIsTheLampsFlux) {
    const Scene scene = box_with_a_lamp_behind();
    double flux = 0;
    for (const auto& light : scene.lights()) flux += light->power();
    RunningStats emitted;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        RenderOptions options;
        options.seed = seed;
        const RenderResult result = picture(maps_seen_directly(), options, 2, 1);
        EXPECT_LT(result.report.numbers().at("energy.imbalance"), 1e-12);
        emitted.add(result.report.numbers().at("energy.emitted"));
    }
    EXPECT_TRUE(testing::agrees(emitted, flux)) << emitted.mean() << " of " << flux;
    EXPECT_LT(emitted.standard_error(), 0.01 * flux);
}

// The radius is fixed, so that both means have the same bias and differ by noise alone (4 sigmas).
TEST(SteeredEmission, Progressive_HasTheMeanOfPlainPasses) {
    ProgressiveSettings settings;
    settings.photons = 4000;
    settings.samples = 1;
    settings.estimate.radius = 0.15F;
    settings.direct = DirectMethod::map;
    settings.quantity = Quantity::illuminance;
    RunningStats plain, steered;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
        RenderOptions options;
        options.seed = seed;
        settings.pre_pass = 0;
        plain.add(testing::luminance_stats(picture(settings, options, 8).image).mean());
        settings.pre_pass = 4096;
        options.seed = 100 + seed;
        steered.add(testing::luminance_stats(picture(settings, options, 8).image).mean());
    }
    const double error = std::hypot(plain.standard_error(), steered.standard_error());
    EXPECT_LT(std::fabs(plain.mean() - steered.mean()), 4 * error);
    EXPECT_GT(std::fabs(1.03 * plain.mean() - steered.mean()), 4 * error);  // detects an error of 3 %
}

}  // namespace steering_test
}  // namespace lucerna
