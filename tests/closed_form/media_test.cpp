// Tests participating media with every method: closed forms, furnaces, and comparisons with the path tracer.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/media_methods.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace media_test {

using namespace lucerna::testing;

// A sphere of radius 1 and albedo ρ is full of gas and lit from its centre. The points at the other end of a
// chord of length c to c + dc are c dc/2 of the sphere; e^{-σc} of their light arrives. With K the mean of
// that, E = Φ/(4π) e^{-σ} + ρ K E.
TEST(Absorption, IntegratingSphereOfGas_ShowsItsSeriesUnderEveryMethod) {
    const Rgb sigma_a(0, 0.3F, 1.5F);
    constexpr double kAlbedo = 0.7, kFlux = 4 * M_PI;
    SceneMaker make;
    make.sphere(V3f(0.0F), 1, make.diffuse(Rgb(static_cast<float>(kAlbedo))));
    make.camera_in(make.medium(homogeneous(sigma_a, Rgb(0))));
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    const Scene scene = make.build();
    const V3f eye(0.3F, -0.2F, 0.1F);
    for (const Method& method : methods()) {
        // The error of a density estimate at one point is that of the photons near it, in every sample, so
        // maps are seen at many points.
        const bool maps = std::string(method.name).find("maps") != std::string::npos;
        const int targets = maps ? 32 : 1;
        const int samples = maps ? 100 : method.name == std::string("path") ? 20'000 : 4000;
        std::array<RunningStats, 3> ratios;
        for (int i = 0; i < targets; ++i) {
            const double z = 1 - (2 * i + 0.7) / targets, r = std::sqrt(1 - z * z), phi = 2.4 * i + 0.5;
            const V3f target(V3d(r * std::cos(phi), r * std::sin(phi), z));
            const double seen_from = static_cast<double>((target - eye).length());
            const Colour stats = radiance(scene, method.settings, from_to(eye, target), samples);
            for (int k = 0; k < 3; ++k) {
                const double sigma = static_cast<double>(sigma_a[k]);
                const double mean =
                    sigma > 0 ? (1 - std::exp(-2 * sigma) * (1 + 2 * sigma)) / (2 * sigma * sigma) : 1;
                const double irradiance = kFlux / (4 * M_PI) * std::exp(-sigma) / (1 - kAlbedo * mean);
                const double expected = kAlbedo / M_PI * irradiance * std::exp(-sigma * seen_from);
                const auto channel = static_cast<std::size_t>(k);
                ratios[channel].add(stats[channel].mean() / expected);
            }
        }
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(ratios[static_cast<std::size_t>(k)].mean(), 1, maps ? 0.04 : 0.015)
                << method.name << ", channel " << k;
        }
    }
}

// --- furnaces

// Returns the tolerance. VPLs without a least distance have unbounded variance, 1/d² at both ends of a
// connection in a medium: the denser it is, the more of the mean is in rare samples.
double furnace_bound(const Method& method, int channel) {
    if (!std::holds_alternative<IgiSettings>(method.settings)) return 0.02;
    return channel == 2 ? 0.15 : 0.05;
}

TEST(MediaFurnaces, GlowingWallsAroundALosslessMedium_ShowTheirSeriesUnderEveryMethod) {
    SceneMaker make;
    Quadric& wall = make.sphere(V3f(0.0F), 1, make.diffuse(Rgb(0.5F)));
    wall.traits.reverse_orientation = true;
    wall.traits.light = make.light(make_area_light(SphereEmitter{V3f(0.0F), 1, true}, Rgb(3), false));
    make.camera_in(make.medium(homogeneous(Rgb(0), {0.2F, 1, 3}, 0.5F)));
    const Scene scene = make.build();
    for (const Method& method : methods()) {
        const Colour stats = radiance(scene, method.settings, 8000, [](const V2f& u) {
            const float z = 2 * u.x - 1, s = std::sqrt(1 - z * z), phi = 2 * kPi * u.y;
            return Ray{{0.3F, -0.2F, 0.1F}, {s * std::cos(phi), s * std::sin(phi), z}};
        });
        for (int k = 0; k < 3; ++k) {
            EXPECT_NEAR(stats[static_cast<std::size_t>(k)].mean() / 6, 1, furnace_bound(method, k))
                << method.name << ", channel " << k;
        }
    }
}

// Bounds the variance of VPLs: compensation adds what a least distance cuts off. Light refracted by glass
// before it is scattered is a caustic, which only compensating rays show.
IntegratorSettings bounded(IntegratorSettings settings) {
    if (auto* igi = std::get_if<IgiSettings>(&settings)) {
        igi->mindist = 0.3F;
        igi->nsets = 4096;
        igi->gather_samples = 1;
        igi->caustic_paths = 0;
    }
    return settings;
}

TEST(MediaFurnaces, LosslessMediumUnderAnEvenSky_CannotBeSeenByAnyMethod) {
    for (const char* const what : {"region", "interface", "glass"}) {
        SceneMaker make;
        const std::string name = what;
        const Medium cloud = homogeneous(Rgb(0), {0.5F, 2, 4}, 0.6F);
        if (name == "region") make.region(in_box(cloud, V3d(-1.0), V3d(1.0)));
        if (name == "interface") make.ball_of(make.medium(cloud), V3f(0.0F), 1);
        if (name == "glass") {
            Quadric& ball = make.sphere(V3f(0.0F), 1, make.material(DielectricMaterial{}));
            ball.traits.media = {true, make.medium(cloud), kNoMedium};
        }
        make.light(make_infinite_light(Rgb(2), SceneSphere{V3f(0.0F), 2}));
        const Scene scene = make.build();
        for (const Method& method : methods()) {
            const Colour stats = radiance(scene, bounded(method.settings), 8000, [](const V2f& u) {
                return Ray{{-3, 2 * u.x - 1, 2 * u.y - 1}, V3f(1, 0.1F, -0.05F).normalized()};
            });
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(stats[static_cast<std::size_t>(k)].mean() / 2, 1, 0.02)
                    << what << ", " << method.name << ", channel " << k;
            }
        }
    }
}

// --- comparisons with the path tracer

Image image_of(Scene scene, const IntegratorSettings& settings, int spp, int size = 16) {
    Monitor silent;
    const Job job = make_job(std::move(scene), testing::small_cornell_camera(size), settings, spp);
    return render(job, {11, Workers{2}}, silent).image;
}

TEST(FoggyCornell, EveryMethod_ShowsWhatThePathTracerShows) {
    for (const float sigma : {0.4F, 2.0F}) {
        const float g = sigma > 1 ? 0.5F : 0.0F;
        const Image truth = image_of(foggy_cornell(sigma, g), PathSettings{}, 1024);
        std::vector<Method> all = methods();
        ProgressiveSettings passes;
        passes.photons = 20'000;
        all.push_back({"progressive", passes});
        for (const Method& method : all) {
            if (std::holds_alternative<PathSettings>(method.settings)) continue;
            // A sample of VPLs is noisier, and costs less, than one of photon maps.
            const int spp = std::holds_alternative<IgiSettings>(method.settings) ? 2048 : 64;
            const Image image = image_of(foggy_cornell(sigma, g), bounded(method.settings), spp);
            const Rgb mean = testing::mean_rgb(image), expected = testing::mean_rgb(truth);
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(mean[k] / expected[k], 1, 0.025F) << sigma << ' ' << method.name << ' ' << k;
            }
            // These are the blocks of 4 × 4 pixels in which the lamp is not visible.
            for (int by = 1; by < 4; ++by) {
                for (int bx = 0; bx < 4; ++bx) {
                    double a = 0, b = 0;
                    for (int i = 0; i < 16; ++i) {
                        a += static_cast<double>(luminance(image.rgb_at(4 * bx + i % 4, 4 * by + i / 4)));
                        b += static_cast<double>(luminance(truth.rgb_at(4 * bx + i % 4, 4 * by + i / 4)));
                    }
                    EXPECT_NEAR(a / b, 1, 0.06) << sigma << ' ' << method.name << ' ' << bx << ' ' << by;
                }
            }
        }
    }
}

TEST(FoggyCornell, ADenserFogOrAnotherPhase_IsDetected) {
    const Rgb truth = testing::mean_rgb(image_of(foggy_cornell(2, 0), PathSettings{}, 256));
    const auto settings = photons(DirectMethod::mc, IndirectMethod::map);
    EXPECT_NEAR(testing::mean_rgb(image_of(foggy_cornell(2, 0), settings, 16)).y / truth.y, 1, 0.03);
    EXPECT_GT(std::fabs(testing::mean_rgb(image_of(foggy_cornell(2.6F, 0), settings, 16)).y / truth.y - 1),
              0.03);
    EXPECT_GT(std::fabs(testing::mean_rgb(image_of(foggy_cornell(2, 0.8F), settings, 16)).y / truth.y - 1),
              0.03);
}

}  // namespace media_test
}  // namespace lucerna
