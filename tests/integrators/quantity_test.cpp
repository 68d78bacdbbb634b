// Tests images of illuminance against closed forms, with every integrator, and the unit that images state.
#include "engine/scene/quantity.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/render/render.h"
#include "lights/photometric.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace quantity_test {

using testing::SceneMaker;

constexpr float kHeight = 2;

template <typename Settings>
Settings metering(Settings settings = {}) {
    settings.quantity = Quantity::illuminance;
    return settings;
}

std::vector<IntegratorSettings> every_meter() {
    PhotonMapSettings photons;
    photons.photons = 200'000;
    photons.gather_rays = 4;
    IgiSettings igi;
    igi.nlights = 128;
    igi.nsets = 64;
    igi.mindist = 1e-6F;  // no fading
    return {metering<PathSettings>(), metering<DirectSettings>(), metering(photons), metering(igi)};
}

// Returns a lamp of 90 cd at nadir and 30 cd at the horizon, linear between.
std::shared_ptr<const PhotometricWeb> cone_lamp() {
    return std::make_shared<const PhotometricWeb>(
        PhotometricGrid{PhotometricPlanes::c, {0, 90}, {0, 360}, {90, 30, 90, 30}});
}

// Returns a floor at y = 0 under a lamp at height kHeight.
SceneMaker floor_under_lamp(MaterialModel model) {
    SceneMaker make;
    make.quad({-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, make.material(std::move(model)));
    const LightAxes down{{1, 0, 0}, {0, 0, -1}, {0, -1, 0}};
    make.light(make_photometric_light("ies", cone_lamp(), {{0, kHeight, 0}, down}, Rgb(1.0F)));
    return make;
}

RenderResult shoot(Scene scene, const Camera& camera, const IntegratorSettings& settings, int spp) {
    Monitor silent;
    const Job job = testing::make_job(std::move(scene), camera, settings, spp);
    return render(job, {5, Workers{2}}, silent);
}

// Expects E = I(γ) cos³γ / h² at the pixel's centre; the reflectance of the surface does not matter.
TEST(Illuminance, FloorUnderALamp_IsIntensityTimesCosineCubedOverHeightSquared) {
    const MaterialModel materials[] = {DiffuseMaterial{RgbTexture::constant(Rgb(0.2F, 0.5F, 0))},
                                       MirrorMaterial{}};
    for (const MaterialModel& material : materials) {
        for (const IntegratorSettings& settings : every_meter()) {
            Scene scene = floor_under_lamp(material).build();
            const Camera camera = testing::camera({0, 1.5F, 3}, {0.5F, 0, 0}, 16, 16, 40);
            const V3f origin(scene.origin());
            const RenderResult result = shoot(std::move(scene), camera, settings, 4);
            EXPECT_EQ(result.image.attributes.at("lucerna.unit"), "lx");
            for (int i = 0; i < 16; i += 5) {
                const Ray ray = camera.ray({static_cast<float>(i) + 0.5F, 8.5F}, {0.5F, 0.5F});
                const V3f x = ray.at(-(ray.o.y + origin.y) / ray.d.y) + origin;
                const double r = std::hypot(double{x.x}, double{x.z});
                const double gamma = std::atan2(r, double{kHeight});
                const double intensity = 90 - 60 * gamma / (M_PI / 2);
                const double expected = intensity * std::pow(std::cos(gamma), 3) / (kHeight * kHeight);
                const Rgb value = result.image.rgb_at(i, 8);
                EXPECT_NEAR(double{value.x} / expected, 1, 0.02) << integrator_name(settings) << " " << i;
                EXPECT_EQ(value.x, value.y);
            }
        }
    }
}

// On the wall of an integrating sphere E = Φ/(4πr²)/(1-ρ), all bounces included.
TEST(Illuminance, IntegratingSphere_CountsAllBounces) {
    constexpr float kAlbedo = 0.5F, kFlux = 100;
    const double direct = double{kFlux} / (4 * M_PI);
    const Camera camera = testing::camera({0.3F, -0.2F, 0.1F}, {1, 0.5F, 0.2F}, 8, 8, 70);
    for (const IntegratorSettings& settings : every_meter()) {
        const RenderResult result = shoot(testing::integrating_sphere(kAlbedo, kFlux), camera, settings, 64);
        const bool all = integrator_name(settings) != "direct";
        EXPECT_NEAR(testing::luminance_stats(result.image).mean() / (all ? 2 * direct : direct), 1, 0.02)
            << integrator_name(settings);
        EXPECT_EQ(result.image.attributes.at("lucerna.unit"), "W/m^2");
    }
}

// Fog attenuates the light between camera and floor as well as that between lamp and floor; illuminance on
// the floor depends on the second alone.
TEST(Illuminance, ThroughFog_TheCamerasOwnWayDoesNotCount) {
    const auto metered = [](float eye_height) {
        SceneMaker make = floor_under_lamp(DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))});
        Medium fog;
        fog.sigma_a = Rgb(0.3F);
        make.camera_in(make.medium(fog));
        const Camera camera = testing::camera({0, eye_height, 0}, {0, 0, 0}, 3, 3, 1);
        const RenderResult result = shoot(make.build(), camera, metering<PathSettings>(), 16);
        return testing::luminance_stats(result.image).mean();
    };
    const double near = metered(0.5F), far = metered(1.9F);
    EXPECT_NEAR(near / far, 1, 5e-3) << "the farther camera sees a little more of the floor";
    EXPECT_NEAR(near / (90 / 4.0 * std::exp(-0.3 * 2)), 1, 0.01);
}

TEST(Illuminance, WhatShinesBeforeTheSurface_IsNoPartOfIt) {
    SceneMaker make;
    // The camera looks at a lamp, on which no light falls.
    make.quad_light({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, make.diffuse(Rgb(0.5F)), Rgb(7.0F));
    const Camera camera = testing::camera({0, 0, 3}, {0, 0, 0}, 4, 4, 10);
    const RenderResult result = shoot(make.build(), camera, metering<PathSettings>(), 4);
    EXPECT_EQ(testing::luminance_stats(result.image).mean(), 0);
}

TEST(Unit, OfAnImage_IsThatOfItsLights) {
    const Camera camera = testing::camera({0, 1, 3}, {0, 0, 0}, 4, 4, 40);
    const auto unit_with = [&](SceneMaker make) {
        return shoot(make.build(), camera, PathSettings{}, 1).image.attributes.at("lucerna.unit");
    };
    SceneMaker lamp = floor_under_lamp(DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))});
    EXPECT_EQ(unit_with(std::move(lamp)), "cd/m^2");
    SceneMaker both = floor_under_lamp(DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))});
    both.light(make_point_light({0, 3, 0}, Rgb(1.0F)));
    EXPECT_EQ(unit_with(std::move(both)), "mixed (some lights in W, some in lm)");
    SceneMaker watts;
    watts.light(make_point_light({0, 3, 0}, Rgb(1.0F)));
    EXPECT_EQ(unit_with(std::move(watts)), "W/(m^2 sr)");
    SceneMaker dark = floor_under_lamp(DiffuseMaterial{RgbTexture::constant(Rgb(0.5F))});
    dark.light(make_point_light({0, 3, 0}, Rgb(0.0F)));
    EXPECT_EQ(unit_with(std::move(dark)), "cd/m^2") << "a light without power has no say";
}

}  // namespace quantity_test
}  // namespace lucerna
