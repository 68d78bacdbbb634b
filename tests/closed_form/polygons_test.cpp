// Tests rectangles against the contour integral, interreflection between parallel plates, and furnaces by
// every method [tests/support/closed_forms.h].
#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "tests/support/closed_forms.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace polygons_test {

using testing::SceneMaker;

double mean_luminance(Scene scene, const Camera& camera, const IntegratorSettings& settings, int spp) {
    Monitor silent;
    const Job job = testing::make_job(std::move(scene), camera, settings, spp);
    return testing::luminance_stats(render(job, {3, Workers{}}, silent).image).mean();
}

PhotonMapSettings maps_seen_directly() {
    PhotonMapSettings maps;
    maps.direct = DirectMethod::map;
    maps.indirect = IndirectMethod::map;
    return maps;
}

IgiSettings many_vpls() {
    IgiSettings igi;
    igi.mindist = 1e-6F;  // no fading
    igi.nlights = 256;
    igi.nsets = 64;
    return igi;
}

struct Tilt {
    const char* name;
    V3f n;       // normal of the patch at the origin
    V3f corner;  // corner of the rectangle, 2 along a and 1 along b, emitting along a × b
    V3f a, b;
};

std::ostream& operator<<(std::ostream& out, const Tilt& tilt) {
    return out << tilt.name;
}

class Rectangle : public ::testing::TestWithParam<Tilt> {};

// A patch of albedo 1/2 lies under a rectangle of radiance 10.
TEST_P(Rectangle, OverTiltedPatch_SampledWithinOnePercent_MapWithinTwo) {
    const Tilt tilt = GetParam();
    const V3d corner(tilt.corner), a(tilt.a), b(tilt.b);
    const double expected =
        0.5 / M_PI * 10 *
        testing::contour_irradiance({corner, corner + a, corner + a + b, corner + b}, V3d(0.0), V3d(tilt.n));
    PhotonMapSettings map = maps_seen_directly();
    map.photons = 4'000'000;
    map.estimate.k = 0;
    map.estimate.radius = 0.06F;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(DirectSettings{}),
          IntegratorSettings(map)}) {
        SceneMaker make;
        const Frame frame(tilt.n);
        make.quad(-0.3F * (frame.s + frame.t), 0.6F * frame.s, 0.6F * frame.t, make.diffuse(Rgb(0.5F)));
        make.quad_light(tilt.corner, tilt.a, tilt.b, make.diffuse(Rgb(0)), Rgb(10.0F));
        const Camera camera = testing::camera(0.3F * tilt.n + 0.1F * frame.s, {0, 0, 0}, 8, 8, 2);
        const bool from_map = std::holds_alternative<PhotonMapSettings>(settings);
        const double mean = mean_luminance(make.build(), camera, settings, from_map ? 1 : 512);
        EXPECT_NEAR(mean / expected, 1, from_map ? 0.02 : 0.01) << integrator_name(settings);
    }
}

const V3f kSlanted = V3f(0.6F, 0.8F, 0);
INSTANTIATE_TEST_SUITE_P(
    Tilts, Rectangle,
    ::testing::Values(Tilt{"above", {0, 1, 0}, {-0.5F, 1, -0.25F}, {2, 0, 0}, {0, 0, 1}},
                      Tilt{"slanted", kSlanted, {-0.5F, 1, -0.25F}, {2, 0, 0}, {0, 0, 1}},
                      // Part of the rectangle lies below the patch's horizon.
                      Tilt{"cut_by_the_horizon", kSlanted, {-2.2F, 1, -0.5F}, {2, 0, 0}, {0, 0, 1}},
                      Tilt{"standing_beside", {0, 1, 0}, {0.7F, -0.5F, -1}, {0, 0, 2}, {0, 1, 0}}),
    [](const ::testing::TestParamInfo<Tilt>& of) { return std::string(of.param.name); });

// Two parallel plates are so large that each sees nothing else: the upper one emits radiance L and reflects
// ρ2, the lower one reflects ρ1 and has the radiance ρ1 L / (1 - ρ1 ρ2).
TEST(ParallelPlates, WithLightBetweenThem_EveryMethodWithinTwoPercent) {
    constexpr double kLower = 0.7, kUpper = 0.6, kRadiance = 3;
    const double expected = kLower * kRadiance / (1 - kLower * kUpper);
    PhotonMapSettings gather;
    gather.photons = 400'000;
    PhotonMapSettings map = maps_seen_directly();
    map.photons = 400'000;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(gather), IntegratorSettings(map)}) {
        SceneMaker make;
        make.quad({-40, 0, -40}, {0, 0, 80}, {80, 0, 0}, make.diffuse(Rgb(static_cast<float>(kLower))));
        make.quad_light({-40, 1, -40}, {80, 0, 0}, {0, 0, 80}, make.diffuse(Rgb(static_cast<float>(kUpper))),
                        Rgb(static_cast<float>(kRadiance)));
        const Camera camera = testing::camera({0, 0.5F, 0}, {0.2F, 0, 0}, 8, 8, 40);
        const double mean = mean_luminance(make.build(), camera, settings, 256);
        EXPECT_NEAR(mean / expected, 1, 0.02) << integrator_name(settings);
    }
}

// Every surface emits 2 and reflects ρ: the radiance is 2/(1-ρ) in every direction.
TEST(Furnace, EveryMethod_WithinOnePercent) {
    PhotonMapSettings gather;
    gather.photons = 200'000;
    gather.gather_rays = 4;
    PhotonMapSettings map = maps_seen_directly();
    map.photons = 400'000;
    for (const double albedo : {0.0, 0.5, 0.8}) {
        for (const IntegratorSettings& settings :
             {IntegratorSettings(gather), IntegratorSettings(map), IntegratorSettings(many_vpls())}) {
            SceneMaker make;
            Quadric& sphere = make.sphere(V3f(0.0F), 1.0F, make.diffuse(Rgb(static_cast<float>(albedo))));
            sphere.traits.reverse_orientation = true;
            sphere.traits.light =
                make.light(make_area_light(SphereEmitter{V3f(0.0F), 1, true}, Rgb(2.0F), false));
            const Camera camera = testing::camera({0.3F, -0.2F, 0.1F}, {1, 0.5F, 0.2F}, 16, 16, 70);
            const double mean = mean_luminance(make.build(), camera, settings, 16);
            EXPECT_NEAR(mean * (1 - albedo) / 2, 1, 0.01)
                << integrator_name(settings) << ", albedo " << albedo;
        }
    }
}

}  // namespace polygons_test
}  // namespace lucerna
