// Participating media by every method: closed forms, furnaces, and each beside the path tracer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "engine/render/integrator.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

using testing::agrees;
using ::testing::HasSubstr;
using testing::homogeneous;
using testing::in_box;
using testing::SceneMaker;

using Colour = std::array<RunningStats, 3>;

struct Method {
    const char* name;
    IntegratorSettings settings;
};

PhotonMapSettings photons(DirectMethod direct, IndirectMethod indirect) {
    PhotonMapSettings s;
    s.photons = 200'000;
    s.direct = direct;
    s.indirect = indirect;
    s.gather_rays = 4;
    return s;
}

IgiSettings virtual_lights() {
    IgiSettings s;
    s.mindist = 0;
    s.nlights = 64;
    s.nsets = 256;
    return s;
}

std::vector<Method> methods() {
    return {{"path", PathSettings{}},
            {"igi", virtual_lights()},
            {"photonmap", photons(DirectMethod::mc, IndirectMethod::gather)},
            {"photonmap, maps seen", photons(DirectMethod::mc, IndirectMethod::map)},
            {"photonmap, all maps", photons(DirectMethod::map, IndirectMethod::map)}};
}

template <typename RayOf>
Colour radiance(const Scene& scene, const IntegratorSettings& settings, int samples, RayOf ray_of) {
    Monitor monitor;
    RenderReport report;
    const Workers workers{2};
    const auto estimator = make_integrator(settings)->prepare({scene, 7, 0, workers, monitor, report});
    std::vector<Rgb> values(static_cast<std::size_t>(samples));
    parallel_ranges(workers, samples, 256, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (std::int64_t i = begin; i < end; ++i) {
            Stream stream = Stream::stratified(7, Purpose::test, 0, static_cast<std::uint32_t>(i));
            const Ray ray = ray_of(stream.next2());
            values[static_cast<std::size_t>(i)] = estimator->radiance(ray, stream);
        }
    });
    Colour stats;
    for (const Rgb& value : values) {
        for (int k = 0; k < 3; ++k) stats[static_cast<std::size_t>(k)].add(static_cast<double>(value[k]));
    }
    EXPECT_EQ(scene.invalid_rays(), 0U);
    return stats;
}
Colour radiance(const Scene& scene, const IntegratorSettings& settings, const Ray& ray, int samples) {
    return radiance(scene, settings, samples, [&](const V2f&) { return ray; });
}

Ray from_to(const V3f& eye, const V3f& target) {
    return {eye, (target - eye).normalized()};
}

// --- absorption alone

// A light 1 m over a floor, seen from the side: L = ρ/π I cosθ/d² times what both ways let through.
struct OverFloor {
    const char* name;
    void (*place)(SceneMaker&, const Medium&);
    double light_length, eye_length;  // in the medium
};

constexpr float kX = 0.5F;  // where the eye looks
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
        {"box by borders",
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
    // What a density estimate of k photons leaves: some 1/√k, and the light's fall over the disc.
    auto& maps = std::get<PhotonMapSettings>(all[4].settings);
    maps.photons = 500'000;
    maps.k = 2000;
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

// A sphere of radius 1 and albedo ρ, full of gas, lit from its middle. The point at the other end of a chord
// of length c is c dc/2 of the sphere; of what it sends e^{-σc} arrives. With K the mean of that,
// E = Φ/(4π) e^{-σ} + ρ K E.
TEST(Absorption, IntegratingSphereOfGas_ShowsItsSeriesUnderEveryMethod) {
    const Rgb sigma_a(0, 0.3F, 1.5F);
    constexpr double kAlbedo = 0.7, kFlux = 4 * M_PI;
    SceneMaker make;
    make.sphere(V3f(0.0F), 1, make.diffuse(Rgb(static_cast<float>(kAlbedo))));
    make.camera_in(make.medium(homogeneous(sigma_a, Rgb(0))));
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    const Scene scene = make.build();
    const V3f eye(0.3F, -0.2F, 0.1F), target = V3f(1, 0.5F, 0.2F).normalized();
    const double seen_from = static_cast<double>((target - eye).length());
    for (const Method& method : methods()) {
        const int samples = method.name == std::string("path") ? 20'000 : 4000;
        const Colour stats = radiance(scene, method.settings, from_to(eye, target), samples);
        for (int k = 0; k < 3; ++k) {
            const double sigma = static_cast<double>(sigma_a[k]);
            const double mean =
                sigma > 0 ? (1 - std::exp(-2 * sigma) * (1 + 2 * sigma)) / (2 * sigma * sigma) : 1;
            const double irradiance = kFlux / (4 * M_PI) * std::exp(-sigma) / (1 - kAlbedo * mean);
            const double expected = kAlbedo / M_PI * irradiance * std::exp(-sigma * seen_from);
            const double ratio = stats[static_cast<std::size_t>(k)].mean() / expected;
            const bool seen = std::string(method.name).find("map") != std::string::npos;
            EXPECT_NEAR(ratio, 1, seen ? 0.06 : 0.015) << method.name << ", channel " << k;
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

// --- furnaces

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
            EXPECT_NEAR(stats[static_cast<std::size_t>(k)].mean() / 6, 1, 0.02)
                << method.name << ", channel " << k;
        }
    }
}

TEST(MediaFurnaces, LosslessMediumUnderAnEvenSky_CannotBeSeenByAnyMethod) {
    for (const char* const what : {"region", "border", "glass"}) {
        SceneMaker make;
        const std::string name = what;
        const Medium cloud = homogeneous(Rgb(0), {0.5F, 2, 4}, 0.6F);
        if (name == "region") make.region(in_box(cloud, V3d(-1.0), V3d(1.0)));
        if (name == "border") make.ball_of(make.medium(cloud), V3f(0.0F), 1);
        if (name == "glass") {
            Quadric& ball = make.sphere(V3f(0.0F), 1, make.material(DielectricMaterial{}));
            ball.traits.media = {true, make.medium(cloud), kNoMedium};
        }
        make.light(make_infinite_light(Rgb(2), SceneSphere{V3f(0.0F), 2}));
        const Scene scene = make.build();
        for (const Method& method : methods()) {
            const Colour stats = radiance(scene, method.settings, 8000, [](const V2f& u) {
                return Ray{{-3, 2 * u.x - 1, 2 * u.y - 1}, V3f(1, 0.1F, -0.05F).normalized()};
            });
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(stats[static_cast<std::size_t>(k)].mean() / 2, 1, 0.03)
                    << what << ", " << method.name << ", channel " << k;
            }
        }
    }
}

// --- beside the path tracer

Scene foggy_cornell(float sigma, float g) {
    static Medium fog;  // what add() below takes; tests run one after the other
    fog = in_box(homogeneous(Rgb(0.1F * sigma), Rgb(sigma, 0.8F * sigma, 0.6F * sigma), g), {0, 0, 0},
                 {1, 1, 1});
    return testing::small_cornell([](SceneMaker& make) { make.region(fog); });
}

Image image_of(Scene scene, const IntegratorSettings& settings, int spp, int size = 16) {
    Monitor silent;
    const Job job = testing::make_job(std::move(scene), testing::small_cornell_camera(size), settings, spp);
    return render(job, {11, Workers{2}}, silent).image;
}

TEST(FoggyCornell, EveryMethod_ShowsWhatThePathTracerShows) {
    for (const float sigma : {0.4F, 2.0F}) {
        const float g = sigma > 1 ? 0.5F : 0.0F;
        const Image truth = image_of(foggy_cornell(sigma, g), PathSettings{}, 1024);
        for (const Method& method : methods()) {
            if (std::holds_alternative<PathSettings>(method.settings)) continue;
            const Image image = image_of(foggy_cornell(sigma, g), method.settings, 64);
            const Rgb mean = testing::mean_rgb(image), expected = testing::mean_rgb(truth);
            for (int k = 0; k < 3; ++k) {
                EXPECT_NEAR(mean[k] / expected[k], 1, 0.025F) << sigma << ' ' << method.name << ' ' << k;
            }
            // Blocks of 4 × 4 pixels, where the lamp is not seen.
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

TEST(FoggyCornell, ADenserFogOrAnotherPhase_IsTold) {
    const Rgb truth = testing::mean_rgb(image_of(foggy_cornell(2, 0), PathSettings{}, 256));
    const auto settings = photons(DirectMethod::mc, IndirectMethod::map);
    EXPECT_NEAR(testing::mean_rgb(image_of(foggy_cornell(2, 0), settings, 16)).y / truth.y, 1, 0.03);
    EXPECT_GT(std::fabs(testing::mean_rgb(image_of(foggy_cornell(2.6F, 0), settings, 16)).y / truth.y - 1),
              0.03);
    EXPECT_GT(std::fabs(testing::mean_rgb(image_of(foggy_cornell(2, 0.8F), settings, 16)).y / truth.y - 1),
              0.03);
}

TEST(FoggyCornell, AnyNumberOfThreads_SameImageBitForBit) {
    const auto image = [](const IntegratorSettings& settings, int threads) {
        Monitor silent;
        const Job job =
            testing::make_job(foggy_cornell(1, 0.3F), testing::small_cornell_camera(12), settings, 2);
        return render(job, {11, Workers{threads}}, silent).image.data;
    };
    auto few = photons(DirectMethod::mc, IndirectMethod::gather);
    few.photons = 20'000;
    auto lights = virtual_lights();
    lights.nsets = 8;
    for (const IntegratorSettings& settings : {IntegratorSettings(few), IntegratorSettings(lights)}) {
        const auto one = image(settings, 1);
        for (const int threads : {2, 5}) EXPECT_EQ(one, image(settings, threads));
    }
}

// --- what is built

std::string volume_note(const Medium& medium, DirectMethod direct, double& stored) {
    Monitor silent;
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
    make.region(in_box(medium, {0, 0, 0}, {1, 1, 1}));
    make.light(make_point_light({0.5F, 0.5F, 0.5F}, Rgb(1)));
    PhotonMapSettings settings = photons(direct, IndirectMethod::map);
    settings.photons = 2000;
    const Job job = testing::make_job(make.build(), testing::small_cornell_camera(4), settings, 1);
    const RenderReport report = render(job, {1, Workers{2}}, silent).report;
    stored = report.numbers.at("photons.volume.stored");
    EXPECT_LT(report.numbers.at("energy.imbalance"), 1e-5);
    return report.notes.at("map.volume");
}

TEST(VolumeMap, IsBuiltOnlyWhereAMediumScatters) {
    double none = 0, some = 0, all = 0;
    EXPECT_THAT(volume_note(homogeneous(Rgb(1), Rgb(0)), DirectMethod::mc, none),
                HasSubstr("not built: no medium of the scene scatters"));
    EXPECT_EQ(none, 0);
    EXPECT_THAT(volume_note(homogeneous(Rgb(1), Rgb(1)), DirectMethod::mc, some),
                HasSubstr("built: what media scatter is read from it, but"));
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
    const Job job = testing::make_job(make.build(), testing::small_cornell_camera(2), IgiSettings{}, 1);
    render(job, {1, Workers{1}}, monitor);
    EXPECT_THAT(monitor.lines, HasSubstr("\"fire\""));
}

}  // namespace
}  // namespace lucerna
