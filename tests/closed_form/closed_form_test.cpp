// Tests scenes whose light has a closed form [tests/support/closed_forms.h].
#include <gtest/gtest.h>

#include <map>

#include "engine/render/render.h"
#include "tests/support/closed_forms.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace closed_form_test {

using testing::SceneMaker;

double mean_luminance(Scene scene, const Camera& camera, const IntegratorSettings& settings, int spp) {
    Monitor silent;
    const Job job = testing::make_job(std::move(scene), camera, settings, spp);
    return testing::luminance_stats(render(job, {3, Workers{}}, silent).image).mean();
}

// The camera is off the centre, so that no symmetry hides a wrong cosine.
Camera inside_sphere() {
    return testing::camera({0.3F, -0.2F, 0.1F}, {1, 0.5F, 0.2F}, 16, 16, 70);
}

struct SphereCase {
    const char* method;
    float albedo;
};

std::ostream& operator<<(std::ostream& out, const SphereCase& c) {
    return out << c.method << " " << c.albedo;
}

class IntegratingSphere : public ::testing::TestWithParam<SphereCase> {};

IntegratorSettings sphere_settings(const std::string& method) {
    if (method == "path") return PathSettings{};
    if (method == "igi") {
        IgiSettings igi;
        igi.mindist = 1e-6F;  // no fading
        igi.nlights = 256;
        igi.nsets = 256;
        return igi;
    }
    if (method == "progressive") {
        ProgressiveSettings progressive;
        progressive.photons = 20'000;
        return progressive;
    }
    PhotonMapSettings photons;
    photons.photons = 200'000;
    photons.gather_rays = 4;
    photons.precompute = 16;  // for millions of photons
    photons.indirect = method == "map" ? IndirectMethod::map : IndirectMethod::gather;
    return photons;
}

// The radiance is ρ/π · Φ/(4πr²)/(1-ρ) everywhere: direct irradiance plus the geometric series of bounces.
TEST_P(IntegratingSphere, Radiance_WithinOnePercent) {
    const auto [method, albedo] = GetParam();
    constexpr float kFlux = 12;
    const double expected = albedo / M_PI * kFlux / (4 * M_PI) / (1 - albedo);
    // The noise at albedo 0.99 is that of the lengths of light paths: some 0.2 % for 200,000 photon paths,
    // 0.4 % for the 65,536 paths of the VPLs.
    const std::map<std::string, int> samples = {{"path", 256}, {"igi", 2}, {"progressive", 32}};
    const int spp = samples.contains(method) ? samples.at(method) : 16;
    const double mean = mean_luminance(testing::integrating_sphere(albedo, kFlux), inside_sphere(),
                                       sphere_settings(method), spp);
    if (albedo == 0) {
        EXPECT_EQ(mean, 0);
    } else {
        RecordProperty("ratio", fmt::format("{:.5f}", mean / expected));
        EXPECT_NEAR(mean / expected, 1, 0.01);
    }
}

std::vector<SphereCase> sphere_cases() {
    std::vector<SphereCase> cases;
    for (const char* method : {"path", "gather", "map", "igi", "progressive"}) {
        for (const float albedo : {0.0F, 0.5F, 0.9F, 0.99F}) cases.push_back({method, albedo});
    }
    return cases;
}
INSTANTIATE_TEST_SUITE_P(All, IntegratingSphere, ::testing::ValuesIn(sphere_cases()),
                         [](const ::testing::TestParamInfo<SphereCase>& c) {
                             return fmt::format("{}_albedo{:03.0f}", c.param.method, 100 * c.param.albedo);
                         });

// At albedo 0.999 a path has a thousand bounces, with as large a standard deviation, so few paths are traced,
// and four standard errors of their length are allowed.
TEST(IntegratingSphereOfAlbedo0999, Radiance_WithinItsNoise) {
    constexpr float kAlbedo = 0.999F;
    constexpr float kFlux = 12;
    const double expected =
        static_cast<double>(kAlbedo) / M_PI * kFlux / (4 * M_PI) / (1 - static_cast<double>(kAlbedo));
    PhotonMapSettings gather;
    gather.photons = 6000;
    gather.gather_rays = 4;
    gather.precompute = 64;
    PhotonMapSettings map = gather;
    map.indirect = IndirectMethod::map;
    IgiSettings igi;
    igi.mindist = 1e-6F;  // no fading
    igi.nlights = 64;
    igi.nsets = 64;
    struct Run {
        IntegratorSettings settings;
        int spp;
        double paths;
    };
    for (const Run& run : {Run{PathSettings{}, 24, 16 * 16 * 24}, Run{gather, 4, 6000}, Run{map, 4, 6000},
                           Run{igi, 4, 64 * 64}}) {
        const double mean = mean_luminance(testing::integrating_sphere(kAlbedo, kFlux), inside_sphere(),
                                           run.settings, run.spp);
        EXPECT_NEAR(mean / expected, 1, 4 / std::sqrt(run.paths)) << integrator_name(run.settings);
    }
}

// Every surface emits L_e and reflects ρ: the radiance is L_e/(1-ρ) in every direction.
TEST(Furnace, Path_WithinHalfAPercent) {
    for (const float albedo : {0.0F, 0.5F, 0.8F}) {
        SceneMaker make;
        Quadric& sphere = make.sphere(V3f(0.0F), 1.0F, make.diffuse(Rgb(albedo)));
        sphere.traits.reverse_orientation = true;
        sphere.traits.light =
            make.light(make_area_light(SphereEmitter{V3f(0.0F), 1, true}, Rgb(2.0F), false));
        const double mean = mean_luminance(make.build(), inside_sphere(), PathSettings{}, 256);
        EXPECT_NEAR(mean * (1 - static_cast<double>(albedo)) / 2, 1, 0.005) << "albedo " << albedo;
    }
}

// A Lambertian disc of radius a over a patch at height h on its axis gives E = π L a²/(a² + h²), so the patch
// has the radiance ρ/π E.
TEST(DiscOverPatch, PathAndDirectWithinOnePercent_MapWithinTwo) {
    constexpr float kRadius = 0.5F;
    constexpr float kHeight = 0.8F;
    constexpr float kAlbedo = 0.6F;
    const double expected = static_cast<double>(kAlbedo * 4 * sqr(kRadius) / (sqr(kRadius) + sqr(kHeight)));
    PhotonMapSettings map;
    map.photons = 8'000'000;
    map.direct = DirectMethod::map;
    map.indirect = IndirectMethod::map;
    map.estimate.k = 200;
    map.estimate.radius = 0.05F;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(DirectSettings{}),
          IntegratorSettings(map)}) {
        SceneMaker make;
        // The floor extends beyond the visible patch, for photons around it.
        make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, make.diffuse(Rgb(kAlbedo)));
        Quadric& disk = make.sphere({0, kHeight, 0}, kRadius, make.diffuse(Rgb(0)));
        disk.kind = Quadric::Kind::disk;
        disk.world_from_object =
            M44d(1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, kHeight, 0, 1);  // z of the disc is -y
        disk.traits.light =
            make.light(make_area_light(DiskEmitter{{0, kHeight, 0}, {0, -1, 0}, kRadius}, Rgb(4.0F), false));
        // The camera, below the disc's edge, sees only the patch around the axis.
        const Camera camera = testing::camera({0.6F, 0.3F, 0}, {0, 0, 0}, 16, 16, 3);
        // The map's estimates use some 10,000 photons in all: 1 % of noise.
        const bool from_map = std::holds_alternative<PhotonMapSettings>(settings);
        const double mean = mean_luminance(make.build(), camera, settings, from_map ? 16 : 256);
        EXPECT_NEAR(mean / expected, 1, from_map ? 0.02 : 0.01) << integrator_name(settings);
    }
}

// Compares the contour integral, the configuration factor in the header of scenes/rectangle-over-patch, and
// renders.
TEST(RectangleOverPatch, PathAndDirect_WithinOnePercent) {
    const auto factor = [](double a, double b) {
        const double u = std::sqrt(1 + a * a), v = std::sqrt(1 + b * b);
        return (a / u * std::atan(b / u) + b / v * std::atan(a / v)) / (2 * M_PI);
    };
    const double header = factor(0.5, 0.25) + factor(0.5, 0.75) + factor(1.5, 0.25) + factor(1.5, 0.75);
    const double irradiance =
        10 * testing::contour_irradiance({{-0.5, 1, -0.25}, {1.5, 1, -0.25}, {1.5, 1, 0.75}, {-0.5, 1, 0.75}},
                                         V3d(0.0), V3d(0, 1, 0));
    EXPECT_NEAR(10 * M_PI * header, irradiance, 1e-12);
    EXPECT_NEAR(0.5 * irradiance / M_PI, 1.51495, 1e-5);
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(DirectSettings{})}) {
        SceneMaker make;
        make.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, make.diffuse(Rgb(0.5F)));
        make.quad_light({-0.5F, 1, -0.25F}, {2, 0, 0}, {0, 0, 1}, make.diffuse(Rgb(0)), Rgb(10.0F));
        const Camera camera = testing::camera({0, 0.2F, 0.2F}, {0, 0, 0}, 8, 8, 1);
        EXPECT_NEAR(mean_luminance(make.build(), camera, settings, 512) / 1.51495, 1, 0.01)
            << integrator_name(settings);
    }
}

// scenes/parallel-plates: of two large parallel plates one emits; the other receives πL, as under an infinite
// sky.
TEST(ParallelPlates, FormFactor_IsOne) {
    SceneMaker make;
    make.quad({-500, 0, -500}, {0, 0, 1000}, {1000, 0, 0}, make.diffuse(Rgb(0.5F)));
    make.quad_light({-500, 1, -500}, {1000, 0, 0}, {0, 0, 1000}, make.diffuse(Rgb(0)), Rgb(3.0F));
    const Camera camera = testing::camera({0, 0.5F, 0}, {0.2F, 0, 0}, 8, 8, 10);
    EXPECT_NEAR(mean_luminance(make.build(), camera, PathSettings{}, 256) / (0.5 * 3), 1, 0.01);
}

}  // namespace closed_form_test
}  // namespace lucerna
