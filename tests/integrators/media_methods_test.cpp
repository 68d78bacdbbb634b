// Tests participating media with every method: the quick tests. Furnaces and fog are in tests/closed_form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/media_methods.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace media_methods_test {

using namespace lucerna::testing;
using ::testing::HasSubstr;

// --- absorption alone

// A light 1 m above a floor, seen from the side: L = ρ/π I cosθ/d² times the transmittance of both segments.
struct OverFloor {
    const char* name;
    void (*place)(SceneMaker&, const Medium&);
    double light_length, eye_length;  // lengths in the medium
};

constexpr float kX = 0.5F;  // x at which the camera looks
const V3f kEye(3, 0, 0.6F);

std::vector<OverFloor> over_floor() {
    const double down = std::hypot(1.0, static_cast<double>(kX)), up = std::hypot(2.5, 0.6);
    return {
        {"everywhere", [](SceneMaker& make, const Medium& m) { make.camera_in(make.medium(m)); }, down, up},
        {"slab",
         [](SceneMaker& make, const Medium& m) {
             make.region(in_box(m, {-10, -10, 0.25}, {10, 10, 0.5}));
         },
         down / 4, up / 0.6 / 4},
        {"box of medium interfaces",
         [](SceneMaker& make, const Medium& m) {
             const auto air = make.material(InterfaceMaterial{});
             const auto inside = make.medium(m);
             const V3f x(0.5F, 0, 0), y(0, 0.5F, 0), z(0, 0, 0.5F), low(-0.25F, -0.25F, 0.75F);
             const V3f high = low + x + y + z;
             const std::pair<V3f, std::pair<V3f, V3f>> sides[] = {{low, {y, x}},    {low, {z, y}},
                                                                  {low, {x, z}},    {high, {-x, -y}},
                                                                  {high, {-y, -z}}, {high, {-z, -x}}};
             for (const auto& [corner, edges] : sides) {
                 make.quad(corner, edges.first, edges.second, air);
                 make.last_mesh().traits.media = {true, inside, kNoMedium};
             }
         },
         down / 4, 0},
        {"ball around the light",
         [](SceneMaker& make, const Medium& m) {
             make.ball_of(make.medium(m), {0, 0, 1}, 0.35F);
         },
         0.35, 0}};
}

TEST(Absorption, LightOverAFloor_FallsByBeersLawUnderEveryMethod) {
    const Rgb sigma_a(0.1F, 0.8F, 2);
    std::vector<Method> all = methods();
    all.push_back({"direct", DirectSettings{}});
    // A density estimate of k photons has a relative noise of some 1/√k, and a bias from the light's falloff
    // over the disc.
    auto& maps = std::get<PhotonMapSettings>(all[4].settings);
    maps.photons = 500'000;
    maps.estimate.k = 2000;
    for (const OverFloor& where : over_floor()) {
        SceneMaker make;
        where.place(make, homogeneous(sigma_a, Rgb(0)));
        make.quad({-10, -10, 0}, {20, 0, 0}, {0, 20, 0}, make.diffuse(Rgb(0.5F)));
        make.light(make_point_light({0, 0, 1}, Rgb(1, 2, 3)));
        const Scene scene = make.build();
        for (const Method& method : all) {
            const bool estimate = &method == &all[4];
            const Colour stats = radiance(scene, method.settings, from_to(kEye, {kX, 0, 0}), 16);
            for (int k = 0; k < 3; ++k) {
                const double sigma = static_cast<double>(sigma_a[k]);
                const double d2 = 1 + static_cast<double>(kX * kX);
                const double expected = 0.5 / M_PI * (k + 1) / (d2 * std::sqrt(d2)) *
                                        std::exp(-sigma * (where.light_length + where.eye_length));
                EXPECT_NEAR(stats[static_cast<std::size_t>(k)].mean() / expected, 1, estimate ? 0.08 : 1e-3)
                    << where.name << ", " << method.name << ", channel " << k;
            }
        }
    }
}

// --- scattering once

TEST(DirectInMedia, PointLightInFog_IsTheLineIntegral) {
    const Rgb sigma_a(0.1F, 0.5F, 0), sigma_s(0.3F, 1, 2);
    const V3d light(0.3, -0.5, 0.4), low(-1.0), high(1.0);
    for (const bool grid : {false, true}) {
        SceneMaker make;
        const Medium fog = homogeneous(sigma_a, sigma_s, 0.4F);
        make.region(grid ? testing::even_grid(fog, low, high, 1) : in_box(fog, low, high));
        make.light(make_point_light(V3f(light), Rgb(1)));
        const Colour stats = radiance(make.build(), DirectSettings{}, testing::kThroughFog, 60'000);
        for (int k = 0; k < 3; ++k) {
            const auto& channel = stats[static_cast<std::size_t>(k)];
            const double s = static_cast<double>(sigma_s[k]), t = s + static_cast<double>(sigma_a[k]);
            EXPECT_TRUE(agrees(channel, testing::single_scattering(s, t, 0.4, light))) << grid << k;
            EXPECT_FALSE(agrees(channel, testing::single_scattering(s, t, -0.4, light))) << grid << k;
            EXPECT_FALSE(agrees(channel, testing::single_scattering(1.1 * s, 1.1 * t, 0.4, light))) << k;
        }
    }
}

TEST(FoggyCornell, AnyNumberOfThreads_SameImageBitForBit) {
    const auto image = [](const IntegratorSettings& settings, int threads) {
        Monitor silent;
        const Job job = make_job(foggy_cornell(1, 0.3F), testing::small_cornell_camera(12), settings, 2);
        return render(job, {11, Workers{threads}}, silent).image.data;
    };
    auto few = photons(DirectMethod::mc, IndirectMethod::gather);
    few.photons = 20'000;
    auto lights = vpls();
    lights.nsets = 8;
    for (const IntegratorSettings& settings : {IntegratorSettings(few), IntegratorSettings(lights)}) {
        const auto one = image(settings, 1);
        for (const int threads : {2, 5}) EXPECT_EQ(one, image(settings, threads));
    }
}

// --- the volume map

std::string volume_note(const Medium& medium, DirectMethod direct, double& stored) {
    Monitor silent;
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
    make.region(in_box(medium, {0, 0, 0}, {1, 1, 1}));
    make.light(make_point_light({0.5F, 0.5F, 0.5F}, Rgb(1)));
    PhotonMapSettings settings = photons(direct, IndirectMethod::map);
    settings.photons = 2000;
    const Job job = make_job(make.build(), testing::small_cornell_camera(4), settings, 1);
    const RenderReport report = render(job, {1, Workers{2}}, silent).report;
    stored = report.numbers().at("photons.volume.stored");
    EXPECT_LT(report.numbers().at("energy.imbalance"), 1e-5);
    return report.notes().at("map.volume");
}

TEST(VolumeMap, IsBuiltOnlyWhereAMediumScatters) {
    double none = 0, some = 0, all = 0;
    EXPECT_THAT(volume_note(homogeneous(Rgb(1), Rgb(0)), DirectMethod::mc, none),
                HasSubstr("not built: no medium of the scene scatters"));
    EXPECT_EQ(none, 0);
    EXPECT_THAT(volume_note(homogeneous(Rgb(1), Rgb(1)), DirectMethod::mc, some),
                HasSubstr("built: light scattered in media is read from it, except"));
    EXPECT_THAT(volume_note(homogeneous(Rgb(1), Rgb(1)), DirectMethod::map, all), HasSubstr("built: "));
    EXPECT_GT(some, 0);
    EXPECT_GT(all, some);
}

TEST(GlowingMedia, UnderAMethodThatDoesNotLookForThem_AreNamed) {
    struct Recording final : Monitor {
        void warn(std::string_view line) override { lines += line; }
        std::string lines;
    } monitor;
    SceneMaker make;
    Medium fire = homogeneous(Rgb(1), Rgb(0));
    fire.name = "fire";
    fire.emission = Rgb(1);
    make.region(fire);
    const Job job = make_job(make.build(), testing::small_cornell_camera(2), IgiSettings{}, 1);
    render(job, {1, Workers{1}}, monitor);
    EXPECT_THAT(monitor.lines, HasSubstr("\"fire\""));
}

}  // namespace media_methods_test
}  // namespace lucerna
