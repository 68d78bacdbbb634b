// Compares the integrators with each other, and with themselves on other numbers of threads.
#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace integrators_test {

using testing::SceneMaker;

RenderResult render_with(Scene scene, const Camera& camera, const IntegratorSettings& settings, int spp,
                         int threads = 2) {
    Monitor silent;
    const Job job = testing::make_job(std::move(scene), camera, settings, spp);
    return render(job, {11, Workers{threads}}, silent);
}

std::vector<IntegratorSettings> every_integrator() {
    PhotonMapSettings gather;
    gather.photons = 20'000;
    gather.gather_rays = 4;
    PhotonMapSettings map = gather;
    map.direct = DirectMethod::map;
    map.indirect = IndirectMethod::map;
    IgiSettings igi;
    igi.nlights = 16;
    igi.nsets = 4;
    ProgressiveSettings progressive;
    progressive.photons = 5'000;
    progressive.samples = 2;
    IgiSettings compensated = igi;
    compensated.gather_samples = 1;
    compensated.mindist = 0.4F;
    return {PathSettings{}, DirectSettings{}, gather, map, igi, compensated, progressive};
}

TEST(Render, AnyNumberOfThreads_SameImageBitForBit) {
    for (const IntegratorSettings& settings : every_integrator()) {
        const auto one =
            render_with(testing::small_cornell(), testing::small_cornell_camera(24), settings, 3, 1);
        for (const int threads : {2, 5, 16}) {
            const auto many = render_with(testing::small_cornell(), testing::small_cornell_camera(24),
                                          settings, 3, threads);
            EXPECT_EQ(one.image.data, many.image.data) << integrator_name(settings);
        }
    }
}

TEST(Render, PhotonsByOurTreeOrByFlann_SameImageBitForBit) {
    const auto scene = [] {
        return testing::small_cornell_with([](testing::SceneMaker& make) {
            make.sphere({0.3F, 0.2F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
        });
    };
    PhotonMapSettings guided;
    guided.photons = 20'000;
    guided.direct = DirectMethod::guided;  // guides direct light and, as the pilot chooses, gather rays
    guided.pre_pass = 2'000;
    IgiSettings igi;
    igi.nlights = 16;
    igi.nsets = 4;
    igi.caustic_paths = 20'000;
    igi.pre_pass = 2'000;
    std::vector<IntegratorSettings> methods = every_integrator();
    methods.emplace_back(guided);
    methods.emplace_back(igi);
    int searched = 0;
    for (const IntegratorSettings& by_tree : methods) {
        IntegratorSettings by_flann = by_tree;
        const bool has_index = std::visit(
            [](auto& settings) {
                if constexpr (requires { settings.index; }) {
                    settings.index = IndexKind::flann;
                    return true;
                }
                return false;
            },
            by_flann);
        if (!has_index) continue;
        ++searched;
        EXPECT_EQ(render_with(scene(), testing::small_cornell_camera(24), by_tree, 3).image.data,
                  render_with(scene(), testing::small_cornell_camera(24), by_flann, 3).image.data)
            << integrator_name(by_tree);
    }
    EXPECT_EQ(searched, 7);
}

TEST(Render, AnotherSeed_AnotherImage) {
    Monitor silent;
    const Job job =
        testing::make_job(testing::small_cornell(), testing::small_cornell_camera(8), PathSettings{}, 2);
    EXPECT_NE(render(job, {1, Workers{2}}, silent).image.data,
              render(job, {2, Workers{2}}, silent).image.data);
}

TEST(Render, NoLights_IsBlackForEveryIntegrator) {
    for (const IntegratorSettings& settings : every_integrator()) {
        SceneMaker make;
        make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
        const auto result =
            render_with(make.build(), testing::camera(V3f(0.5F), {0.5F, 0.5F, 1}, 4, 4, 60), settings, 2);
        EXPECT_EQ(testing::luminance_stats(result.image).mean(), 0) << integrator_name(settings);
        EXPECT_TRUE(result.report.complete);
    }
}

TEST(Render, EmptyScene_IsBlackForEveryIntegrator) {
    for (const IntegratorSettings& settings : every_integrator()) {
        const auto result =
            render_with(SceneMaker().build(), testing::camera(V3f(0.0F), {0, 0, 1}, 4, 4, 60), settings, 2);
        EXPECT_EQ(testing::luminance_stats(result.image).mean(), 0) << integrator_name(settings);
    }
}

TEST(Render, StoppedAtOnce_GivesAnImageAndSaysSo) {
    class Stop final : public Monitor {
        bool stopped() const override { return true; }
    } stop;
    for (const IntegratorSettings& settings : every_integrator()) {
        const Job job =
            testing::make_job(testing::small_cornell(), testing::small_cornell_camera(8), settings, 4);
        const RenderResult result = render(job, {1, Workers{2}}, stop);
        EXPECT_FALSE(result.report.complete);
        EXPECT_EQ(result.report.samples_done, 0);
        EXPECT_EQ(result.image.width, 8);
    }
}

// Compares the mean colour of each method over the box with the path tracer's, within 1 %, which is wider
// than four sigmas of either mean.
TEST(Render, SmallCornell_EveryMethodAgreesWithPathInTheMean) {
    const auto reference =
        render_with(testing::small_cornell(), testing::small_cornell_camera(48), PathSettings{}, 256);
    const Rgb expected = testing::mean_rgb(reference.image);

    PhotonMapSettings gather;
    gather.photons = 300'000;
    gather.gather_rays = 8;
    PhotonMapSettings map = gather;
    map.indirect = IndirectMethod::map;
    map.estimate.k = 50;
    IgiSettings igi;
    igi.mindist = 1e-6F;  // no fading
    igi.nsets = 64;
    igi.nlights = 32;
    const std::pair<const char*, IntegratorSettings> methods[] = {
        {"gather", gather}, {"map", map}, {"igi", igi}};
    for (const auto& [name, settings] : methods) {
        const auto result =
            render_with(testing::small_cornell(), testing::small_cornell_camera(48), settings, 16);
        const Rgb mean = testing::mean_rgb(result.image);
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c] / expected[c], 1, 0.01) << name << " channel " << c;
    }
    // The comparison detects that direct light alone is darker.
    const auto direct =
        render_with(testing::small_cornell(), testing::small_cornell_camera(48), DirectSettings{}, 16);
    EXPECT_LT(testing::mean_rgb(direct.image)[0] / expected[0], 0.9F);
}

// On surfaces that are diffuse and specular or glossy (varnish, gloss, a mirror beneath), photons are
// gathered for the diffuse part and rays traced for the rest; the sum agrees with the path tracer.
TEST(Render, Long_VarnishAndGloss_EveryMethodAgreesWithPath) {
    const auto make_scene = [] {
        SceneMaker make;
        const auto white = make.diffuse(Rgb(0.7F));
        UberMaterial plastic;
        plastic.diffuse = RgbTexture::constant(Rgb(0.4F, 0.2F, 0.2F));
        plastic.gloss = RgbTexture::constant(Rgb(0.3F));
        plastic.roughness = Roughness::of_alpha(0.2F);
        plastic.table = std::make_shared<const CoatTable>(1.5F);
        UberMaterial shiny = plastic;
        shiny.reflect = RgbTexture::constant(Rgb(0.3F));
        SubstrateMaterial substrate;
        substrate.roughness = Roughness::of_alpha(0.25F);
        make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, make.material(substrate));
        make.quad({-1, 0, 1}, {0, 2, 0}, {2, 0, 0}, white);
        make.quad({-1, 0, -1}, {0, 2, 0}, {0, 0, 2}, make.material(plastic));
        make.sphere({0.2F, 0.4F, 0}, 0.35F, make.material(shiny));
        make.quad_light({-0.5F, 1.9F, -0.5F}, {1, 0, 0}, {0, 0, 1}, make.diffuse(Rgb(0)), Rgb(5.0F));
        return make.build();
    };
    const Camera camera = testing::camera({0.5F, 1.2F, -2.2F}, {0, 0.6F, 0}, 32, 32, 50);
    const double expected =
        testing::luminance_stats(render_with(make_scene(), camera, PathSettings{}, 1024).image).mean();
    PhotonMapSettings gather;
    gather.photons = 200'000;
    gather.gather_rays = 4;
    PhotonMapSettings map = gather;
    map.indirect = IndirectMethod::map;
    map.estimate.k = 50;
    for (const PhotonMapSettings& settings : {gather, map}) {
        const auto result = render_with(make_scene(), camera, settings, 32);
        EXPECT_NEAR(testing::luminance_stats(result.image).mean() / expected, 1, 0.01);
        EXPECT_EQ(result.report.numbers().at("photons.global.dropped.surface_not_diffuse"), 0);
    }
    // Direct light alone is another image.
    const auto direct = render_with(make_scene(), camera, DirectSettings{}, 64);
    EXPECT_LT(testing::luminance_stats(direct.image).mean() / expected, 0.95);
}

// Below a glass sphere the caustic is a large part of the light, and only the Caustic map holds it.
TEST(Render, GlassSphereUnderALamp_PhotonMapAndIgiAgreeWithPath) {
    const auto make_scene = [] {
        SceneMaker make;
        const auto white = make.diffuse(Rgb(0.7F));
        make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, white);
        make.sphere({0, 0.5F, 0}, 0.3F, make.material(DielectricMaterial{}));
        make.quad_light({-0.3F, 2, -0.3F}, {0.6F, 0, 0}, {0, 0, 0.6F}, make.diffuse(Rgb(0)), Rgb(10.0F));
        return make.build();
    };
    const Camera camera = testing::camera({0, 1.6F, -2.2F}, {0, 0.2F, 0}, 32, 32, 45);
    const auto reference = render_with(make_scene(), camera, PathSettings{}, 1024);
    PhotonMapSettings settings;
    settings.photons = 400'000;
    settings.gather_rays = 4;
    const auto result = render_with(make_scene(), camera, settings, 32);
    const double expected = testing::luminance_stats(reference.image).mean();
    EXPECT_NEAR(testing::luminance_stats(result.image).mean() / expected, 1, 0.015);
    EXPECT_GT(result.report.numbers().at("photons.caustic.stored"), 1000);
    IgiSettings igi;
    igi.caustic_paths = 400'000;
    const auto by_igi = render_with(make_scene(), camera, igi, 16);
    EXPECT_NEAR(testing::luminance_stats(by_igi.image).mean() / expected, 1, 0.015);
    EXPECT_GT(by_igi.report.numbers().at("photons.caustic.stored"), 1000);
    // Without caustics the image is darker by more than the tolerance.
    igi.caustic_paths = 0;
    const auto without = render_with(make_scene(), camera, igi, 16);
    EXPECT_LT(testing::luminance_stats(without.image).mean() / expected, 0.97);
}

TEST(Render, Report_NamesEveryPhotonAndWatt) {
    PhotonMapSettings settings;
    settings.photons = 5000;
    const auto result = render_with(testing::small_cornell(), testing::small_cornell_camera(8), settings, 1);
    const auto numbers = result.report.numbers();
    EXPECT_LT(numbers.at("energy.imbalance"), 1e-5);
    EXPECT_EQ(numbers.at("paths.emitted") + numbers.at("paths.not_emitted"), 5000);
    EXPECT_EQ(numbers.at("photons.global.stored") + numbers.at("photons.direct.dropped.map_not_wanted") +
                  numbers.at("photons.global.dropped.surface_not_diffuse"),
              numbers.at("paths.hits"));
    EXPECT_GT(numbers.at("rays.total"), 0);
    EXPECT_EQ(result.report.notes().at("map.caustic"), "not built: no surface of the scene is specular");
}

}  // namespace integrators_test
}  // namespace lucerna
