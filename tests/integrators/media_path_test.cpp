// Tests the path tracer in participating media against closed forms, quadrature and itself.
#include <gtest/gtest.h>

#include <functional>

#include "engine/base/stats.h"
#include "engine/integrators/integrator.h"
#include "engine/render/job.h"
#include "engine/render/render.h"
#include "tests/support/media.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace media_path_test {

using testing::agrees;
using testing::homogeneous;
using testing::in_box;
using testing::SceneMaker;
using testing::single_scattering;

using Colour = std::array<RunningStats, 3>;

// Returns the radiance along rays that `ray_of` makes from two random numbers, over `samples` paths.
template <typename RayOf>
Colour radiance(const Scene& scene, int samples, int max_depth, RayOf ray_of) {
    Monitor monitor;
    const Workers workers{2};
    const testing::OnePass estimator(PathSettings{max_depth}, {scene, 7, workers, monitor});
    std::vector<Rgb> values(static_cast<std::size_t>(samples));
    parallel_ranges(workers, samples, 1024, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (std::int64_t i = begin; i < end; ++i) {
            Sampler sampler(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const Ray ray = ray_of(sampler.next2());
            values[static_cast<std::size_t>(i)] = estimator.Li(ray, sampler);
        }
    });
    Colour stats;
    for (const Rgb& value : values) {
        for (int k = 0; k < 3; ++k) stats[static_cast<std::size_t>(k)].add(static_cast<double>(value[k]));
    }
    EXPECT_EQ(scene.invalid_rays(), 0U);
    return stats;
}
Colour radiance(const Scene& scene, const Ray& ray, int samples, int max_depth = 0) {
    return radiance(scene, samples, max_depth, [&](const V2f&) { return ray; });
}

bool same(const RunningStats& a, const RunningStats& b) {
    const double sigma = std::hypot(a.standard_error(), b.standard_error());
    return std::fabs(a.mean() - b.mean()) <= 4 * sigma + 1e-6 * std::fabs(a.mean());
}

const V3d kLow(-1, -1, -1), kHigh(1, 1, 1);
const Ray kThrough = testing::kThroughFog;  // inside the cube from t = 2 to t = 4

// --- single scattering

TEST(MediaPath, PointLightInFog_ScatteredOnceAsTheLineIntegralSays) {
    const Rgb sigma_a(0.1F, 0.5F, 0), sigma_s(0.3F, 1, 2);
    const V3d light(0.3, -0.5, 0.4);
    const auto build = [&](int cells) {
        SceneMaker make;
        const Medium fog = homogeneous(sigma_a, sigma_s, 0.4F);
        make.region(cells == 0 ? in_box(fog, kLow, kHigh) : testing::even_grid(fog, kLow, kHigh, 1));
        make.light(make_point_light(V3f(light), Rgb(1)));
        return make.build();
    };
    for (const int cells : {0, 1}) {
        const Colour stats = radiance(build(cells), kThrough, 300'000, 1);
        for (int k = 0; k < 3; ++k) {
            const auto& channel = stats[static_cast<std::size_t>(k)];
            const auto expected = [&](double scale, double g) {
                const auto s = scale * static_cast<double>(sigma_s[k]);
                return single_scattering(s, s + scale * static_cast<double>(sigma_a[k]), g, light);
            };
            EXPECT_TRUE(agrees(channel, expected(1, 0.4))) << k << ' ' << channel.mean();
            EXPECT_FALSE(agrees(channel, expected(1, 0.3))) << "a wrong g, channel " << k;
            EXPECT_FALSE(agrees(channel, expected(1, -0.4))) << "the other way, channel " << k;
        }
        EXPECT_FALSE(agrees(stats[0], single_scattering(1.05 * 0.3, 1.05 * 0.4, 0.4, light)));
    }
}

// --- absorption

TEST(MediaPath, SkyThroughAnAbsorbingCube_FallsByBeersLaw) {
    SceneMaker make;
    make.region(in_box(homogeneous({0.1F, 0.7F, 2}, Rgb(0)), kLow, kHigh));
    make.light(make_infinite_light(Rgb(1, 2, 3), SceneSphere{}));
    const Colour stats = radiance(make.build(), kThrough, 2000);
    EXPECT_NEAR(stats[0].mean(), std::exp(-0.2), 1e-5);
    EXPECT_NEAR(stats[1].mean(), 2 * std::exp(-1.4), 1e-5);
    EXPECT_NEAR(stats[2].mean(), 3 * std::exp(-4.0), 1e-5);
}

TEST(MediaPath, UnboundedFog_HidesTheSky) {
    SceneMaker make;
    make.camera_in(make.medium(homogeneous(Rgb(0.1F), Rgb(0))));
    make.light(make_infinite_light(Rgb(1), SceneSphere{}));
    EXPECT_EQ(radiance(make.build(), kThrough, 100)[0].mean(), 0);
}

// A lamp without geometry: a plane at x = 5 that shines towards -x and cannot be sampled.
class Sheet final : public Light {
  public:
    std::string_view kind() const override { return "sheet"; }
    Rgb flux() const override { return Rgb(1); }
    std::optional<LeSample> sample_Le(const LeSampleU&) const override { return std::nullopt; }
    std::optional<LightSample> sample_Li(const V3f&, const V2f&, std::optional<CellId>) const override {
        return std::nullopt;
    }
    std::optional<EmittedRadiance> Le(const Ray& ray) const override {
        if (!(ray.d.x > 0 && ray.o.x < 5)) return std::nullopt;
        return EmittedRadiance{Rgb(2), 0, (5 - ray.o.x) / ray.d.x};
    }
    bool has_impostor() const override { return true; }
};

TEST(MediaPath, LampWithoutGeometry_IsSeenOnceThroughAllThatLiesBeforeIt) {
    for (const double end : {4.0, 7.0}) {  // the box ends before the lamp or beyond it
        SceneMaker make;
        make.region(in_box(homogeneous(Rgb(0.1F), Rgb(0)), {-2, -1, -1}, {end, 1, 1}));
        make.ball_of(make.medium(homogeneous(Rgb(0.5F), Rgb(0))), {0, 0.2F, 0.1F}, 1);
        make.light(std::make_unique<Sheet>());
        // Without scattering the estimate has no variance.
        const Colour stats = radiance(make.build(), kThrough, 16);
        const double depth = 0.1 * (std::min(end, 5.0) + 2) + 0.5 * 2;
        EXPECT_NEAR(stats[0].mean(), 2 * std::exp(-depth), 1e-5);
        EXPECT_LT(stats[0].standard_error(), 1e-6);
    }
}

// --- furnaces: a medium that scatters without loss in uniform light is invisible

void expect_radiance(const Scene& scene, double expected, int samples, const char* what) {
    const Colour stats = radiance(scene, samples, 0, [](const V2f& u) {
        return Ray{{-3, 3 * u.x - 1.5F, 3 * u.y - 1.5F}, V3f(1, 0.1F, -0.05F).normalized()};
    });
    for (const RunningStats& channel : stats) {
        EXPECT_TRUE(agrees(channel, expected))
            << what << ' ' << channel.mean() << " ± " << channel.standard_error();
        EXPECT_LT(channel.standard_error(), 0.006 * expected) << what;
    }
}

TEST(MediaFurnace, LosslessMediumUnderAnEvenSky_CannotBeSeen) {
    const Rgb sigma_s(0.5F, 2, 4);
    for (const char* const what : {"region", "grid", "interface", "glass", "overlap"}) {
        SceneMaker make;
        const std::string name = what;
        const Medium cloud = homogeneous(Rgb(0), sigma_s, 0.6F);
        if (name == "region" || name == "overlap") make.region(in_box(cloud, kLow, kHigh));
        if (name == "overlap")
            make.region(in_box(homogeneous(Rgb(0), Rgb(1, 0.5F, 0), -0.3F), {-0.5, -2, -1}, {2, 1, 0.5}));
        if (name == "grid") make.region(testing::rising_along_x(cloud, kLow, kHigh, 8));
        if (name == "interface") make.ball_of(make.medium(cloud), V3f(0.0F), 1);
        if (name == "glass") {
            Quadric& ball = make.sphere(V3f(0.0F), 1, make.material(DielectricMaterial{}));
            ball.traits.media = {true, make.medium(cloud), kNoMedium};
        }
        make.light(make_infinite_light(Rgb(2), SceneSphere{}));
        expect_radiance(make.build(), 2, 40'000, what);
    }
}

// Kirchhoff's law: in uniform light an absorbing medium emits as much as it absorbs if its emission is
// sigma_a times the radiance.
TEST(MediaFurnace, MediumAsHotAsTheSky_CannotBeSeen) {
    for (const bool grid : {false, true}) {
        Medium gas = homogeneous({0.3F, 1, 3}, {1, 0.5F, 0}, 0.2F);
        gas.emission = gas.sigma_a * Rgb(2);
        SceneMaker make;
        make.region(grid ? testing::rising_along_x(gas, kLow, kHigh, 8) : in_box(gas, kLow, kHigh));
        make.light(make_infinite_light(Rgb(2), SceneSphere{}));
        expect_radiance(make.build(), 2, 40'000, grid ? "grid" : "region");
    }
}

TEST(MediaFurnace, GlowingWallsAroundALosslessMedium_ShowTheirSeries) {
    constexpr float kAlbedo = 0.5F;
    SceneMaker make;
    Quadric& wall = make.sphere(V3f(0.0F), 1, make.diffuse(Rgb(kAlbedo)));
    wall.traits.reverse_orientation = true;
    wall.traits.light = make.light(make_area_light(SphereEmitter{V3f(0.0F), 1, true}, Rgb(3), false));
    make.camera_in(make.medium(homogeneous(Rgb(0), {0.2F, 1, 3}, 0.5F)));
    const Colour stats =
        radiance(make.build(), {{0.3F, -0.2F, 0.1F}, V3f(1, 0.5F, 0.2F).normalized()}, 60'000);
    for (const RunningStats& channel : stats) EXPECT_TRUE(agrees(channel, 6)) << channel.mean();
}

// --- equivalent descriptions

Scene lit_cube(const std::function<void(SceneMaker&)>& place) {
    SceneMaker make;
    place(make);
    const auto grey = make.diffuse(Rgb(0.5F, 0.6F, 0.7F));
    make.quad({-4, -1.5F, -4}, {0, 0, 8}, {8, 0, 0}, grey);
    make.quad_light({-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, grey, Rgb(8, 6, 4));
    return make.build();
}

// Encloses a medium in the cube [-1, 1]³ by twelve triangles as medium interfaces.
void cube_of_interfaces(SceneMaker& make, std::int32_t medium) {
    const auto air = make.material(InterfaceMaterial{});
    const V3f x(2, 0, 0), y(0, 2, 0), z(0, 0, 2), low(-1.0F), high(1.0F);
    const std::pair<V3f, std::pair<V3f, V3f>> sides[] = {
        {low, {y, x}}, {low, {z, y}}, {low, {x, z}}, {high, {-x, -y}}, {high, {-y, -z}}, {high, {-z, -x}}};
    for (const auto& [corner, edges] : sides) {
        make.quad(corner, edges.first, edges.second, air);
        make.last_mesh().traits.media = {true, medium, kNoMedium};
    }
}

Colour cube_seen(const Scene& scene, int samples = 60'000) {
    return radiance(scene, samples, 0, [](const V2f& u) {
        const V3f eye(-4, 1.5F, -3);
        const V3f target(2.4F * u.x - 1.2F, 2.4F * u.y - 1.5F, 0);
        return Ray{eye, (target - eye).normalized()};
    });
}

TEST(MediaPath, OneMediumInFourSpellings_LooksTheSame) {
    const Medium cloud = homogeneous({0.1F, 0.3F, 0.6F}, {2, 1.5F, 1}, 0.4F);
    const Medium half = homogeneous({0.05F, 0.15F, 0.3F}, {1, 0.75F, 0.5F}, 0.4F);
    const Colour region =
        cube_seen(lit_cube([&](SceneMaker& make) { make.region(in_box(cloud, kLow, kHigh)); }));
    const std::pair<const char*, Colour> others[] = {
        {"grid", cube_seen(lit_cube(
                     [&](SceneMaker& make) { make.region(testing::even_grid(half, kLow, kHigh, 2)); }))},
        {"two halves", cube_seen(lit_cube([&](SceneMaker& make) {
             make.region(in_box(half, kLow, kHigh));
             make.region(testing::even_grid(half, kLow, kHigh, 1));
         }))},
        {"interfaces",
         cube_seen(lit_cube([&](SceneMaker& make) { cube_of_interfaces(make, make.medium(cloud)); }))},
    };
    for (const auto& [name, stats] : others) {
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_TRUE(same(region[k], stats[k]))
                << name << ' ' << k << ": " << region[k].mean() << " and " << stats[k].mean();
        }
    }
    // The test detects a medium that is a little denser, or scatters in the other direction.
    Medium denser = cloud, back = cloud;
    denser.sigma_s = cloud.sigma_s * 1.2F;
    back.g = -0.4F;
    for (const Medium& other : {denser, back}) {
        const Colour stats =
            cube_seen(lit_cube([&](SceneMaker& make) { make.region(in_box(other, kLow, kHigh)); }));
        EXPECT_FALSE(same(region[0], stats[0]) && same(region[1], stats[1]) && same(region[2], stats[2]));
    }
}

// Renders with the path tracer for media, in a scene whose medium no path meets.
TEST(MediaPath, AMediumFarAway_ChangesNothing) {
    const Colour plain = cube_seen(lit_cube([](SceneMaker&) {}));
    const Colour with = cube_seen(lit_cube([](SceneMaker& make) {
        make.region(in_box(homogeneous(Rgb(1), Rgb(1)), {50, 50, 50}, {51, 51, 51}));
    }));
    for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(with[k].mean() / plain[k].mean(), 1, 1e-6);  // the same paths, with different rounding
}

TEST(MediaPath, LightInALosslessBall_LightsTheSphereAroundItAsWithoutTheBall) {
    // A point light of 4π W in the middle of a lossless ball emits 1 W/sr on average, however the ball
    // scatters: a large diffuse sphere around it receives E = Φ/(4πR²).
    SceneMaker make;
    make.sphere(V3f(0.0F), 10, make.diffuse(Rgb(0.5F)));
    make.ball_of(make.medium(homogeneous(Rgb(0), {0.5F, 1, 2}, 0.3F)), V3f(0.0F), 2);
    make.light(make_point_light(V3f(0.0F), Rgb(1)));
    // The closed sphere then shows ρ/π E/(1 - ρ) as an integrating sphere does, because nothing is absorbed
    // on the way.
    const Colour stats = radiance(make.build(), {{5, 0, 0}, V3f(1, 0.2F, 0.1F).normalized()}, 100'000);
    const double expected = 0.5 / M_PI * (4 * M_PI / (4 * M_PI * 100)) / (1 - 0.5);
    for (const RunningStats& channel : stats)
        EXPECT_TRUE(agrees(channel, expected)) << channel.mean() / expected;
}

TEST(MediaPath, AnyNumberOfThreads_SameImageBitForBit) {
    const auto image = [](int threads) {
        Scene scene = lit_cube([](SceneMaker& make) {
            make.region(testing::rising_along_x(homogeneous(Rgb(0.3F), {1, 2, 3}, 0.3F), kLow, kHigh, 8));
            make.ball_of(make.medium(homogeneous(Rgb(0.1F), Rgb(2))), {0.5F, 0.5F, 0}, 0.7F);
        });
        const Job job = testing::make_job(
            std::move(scene), testing::camera({-4, 1.5F, -3}, V3f(0.0F), 24, 24, 40), PathSettings{}, 4);
        Monitor silent;
        return render(job, {11, Workers{threads}}, silent).image.data;
    };
    const auto one = image(1);
    for (const int threads : {2, 5}) EXPECT_EQ(one, image(threads));
}

}  // namespace media_path_test
}  // namespace lucerna
