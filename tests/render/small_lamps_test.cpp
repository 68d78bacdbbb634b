// Lamps smaller than a pixel are sampled at the lens: pixel by pixel they have the same mean as camera rays
// that hit them by chance, and the closed forms; by every method, through media, lenses and filters.
#include "engine/render/small_lamps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "engine/base/stats.h"
#include "engine/render/render.h"
#include "engine/render/tiles.h"
#include "tests/support/materials.h"
#include "tests/support/media.h"
#include "tests/support/one_pass.h"
#include "tests/support/same_image.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace small_lamps_test {

using testing::SceneMaker;

// Adds an emitting sphere.
void ball(SceneMaker& make, const V3f& centre, float radius, const Rgb& radiance) {
    const auto black = make.diffuse(Rgb(0));
    const std::int32_t light = make.light(make_area_light(SphereEmitter{centre, radius}, radiance, false));
    make.sphere(centre, radius, black).traits.light = light;
}

// Adds several quads that form one light.
void quads(SceneMaker& make, const std::vector<V3f>& corners, float size, const Rgb& radiance) {
    Mesh mesh;
    for (const V3f& corner : corners) {
        const auto first = static_cast<int>(mesh.p.size());
        for (const V3f& p : {V3f(0, 0, 0), V3f(0, size, 0), V3f(size, size, 0), V3f(size, 0, 0)})
            mesh.p.push_back(corner + p);
        mesh.triangles.emplace_back(first, first + 1, first + 2);
        mesh.triangles.emplace_back(first, first + 2, first + 3);
    }
    make.quad({0, 0, 0}, {0, 0, 0}, {0, 0, 0}, make.diffuse(Rgb(0)));
    mesh.traits = make.last_mesh().traits;
    mesh.traits.light = make.light(make_area_light(TriangleEmitter{mesh.p, mesh.triangles}, radiance, false));
    make.last_mesh() = std::move(mesh);
}

// The reflecting part of the scene: the albedo of surfaces, and whether fog fills it.
struct Lit {
    float albedo = 0;
    bool fog = false;
};

// Returns a scene for a camera at the origin that looks along z: a plane; in front of it balls, alone and six
// in one pixel, one half hidden by a wall; a mesh of two distant quads, each of them small; and a lamp that
// is not small.
Scene market(const Lit& lit) {
    SceneMaker make;
    const auto grey = make.diffuse(Rgb(lit.albedo));
    make.quad({-9, -9, 6}, {0, 18, 0}, {18, 0, 0}, grey);
    make.quad({-1.5F, -1.5F, 2}, {0, 1.1F, 0}, {1, 0, 0}, grey);
    ball(make, {1.3F, 0.8F, 4}, 0.05F, Rgb(90, 60, 30));
    ball(make, {-2.7F, 2.1F, 5}, 0.07F, Rgb(50));
    ball(make, {-1.0F, -0.4F, 4}, 0.06F, Rgb(70, 80, 90));   // behind the wall's edge
    ball(make, {0.0F, 0.0F, 4.5F}, 0.08F, Rgb(20, 40, 60));  // where four pixels meet
    for (int i = 0; i < 6; ++i) {
        const auto x = static_cast<float>(i);
        ball(make, {1.6F + 0.09F * x, -1.2F + 0.03F * x, 4 + 0.2F * x}, 0.02F + 0.01F * x, Rgb(10 + 20 * x));
    }
    quads(make, {{-2.2F, 0.9F, 4}, {2.4F, 2.3F, 5}}, 0.1F, Rgb(60, 50, 40));
    make.quad_light({-0.9F, 1.4F, 5}, {0, 1.4F, 0}, {1.8F, 0, 0}, make.diffuse(Rgb(0)), Rgb(2));
    if (lit.fog) {
        make.region(testing::in_box(testing::homogeneous(Rgb(0.05F), Rgb(0.1F, 0.05F, 0.02F)), V3d(-9, -9, 1),
                                    V3d(9, 9, 5)));
    }
    return make.build();
}

constexpr int kSize = 8;

Job job_of(Scene scene, IntegratorSettings method = PathSettings{}, int size = kSize) {
    return testing::make_job(std::move(scene), testing::camera({0, 0, 0}, {0, 0, 1}, size, size, 80),
                             std::move(method), 16);
}

Camera with_lens(const Camera& camera, float radius, float distance) {
    Camera::Settings settings = camera.settings();
    settings.lens_radius = radius;
    settings.focal_distance = distance;
    return Camera(settings);
}

FilterSettings filter_of(FilterSettings::Kind kind, float radius) {
    FilterSettings filter;
    filter.kind = kind;
    filter.radius = V2f(radius);
    return filter;
}

// Selects the part of a sample that is averaged, with its weights, over every pixel.
using Counted = std::function<Rgb(const SampleAccount& account, const Ray& ray)>;
Rgb emission_alone(const SampleAccount& account, const Ray& /*ray*/) {
    return account.layers[static_cast<std::size_t>(Layer::emission)];
}
std::vector<RunningStats> pixels_of(const Job& job, const SmallLamps* lamps, std::uint64_t seed, int samples,
                                    const Counted& counted = emission_alone) {
    Monitor silent;
    const Workers workers{2};
    const testing::OnePass estimator(job.integrator, {job.scene, 3, workers, silent, view_of(job)});
    const CameraSampler sampler(job, seed, 0, lamps);
    const V2i size = job.film.rendered_size();
    std::vector<RunningStats> pixels(static_cast<std::size_t>(size.x) * static_cast<std::size_t>(size.y));
    parallel_each(workers, pixels.size(), 1, [&](std::size_t i) {
        const V2i at(static_cast<int>(i) % size.x, static_cast<int>(i) / size.x);
        SampleAccount account;
        for (int s = 0; s < samples; ++s) {
            account.clear();
            const CameraSampler::Sample sample = sampler.sample(at, s);
            const Film::Sample taken = sampler.radiance(*estimator, sample, account);
            const float value = luminance(counted(account, sample.ray));
            pixels[i].add(double{taken.weight} * double{value});
        }
    });
    return pixels;
}

// The mean over the image, and its standard error.
struct OfImage {
    double mean = 0, error = 0;
};
OfImage image_of(const std::vector<RunningStats>& pixels) {
    OfImage of;
    for (const RunningStats& pixel : pixels) {
        of.mean += pixel.mean() / static_cast<double>(pixels.size());
        of.error += sqr(pixel.standard_error() / static_cast<double>(pixels.size()));
    }
    of.error = std::sqrt(of.error);
    return of;
}

// The differences of two images in standard errors: of the image's mean, and of the pixel that differs most.
// Pixels in which rays hit lamps only a few times, judged by the sampled ones, are pooled: their means are
// far from normal.
struct Apart {
    double image = 0, pixel = 0;
    // The thresholds are equally rare: 4 sigma for the image, 4.8 for the worst of 64 pixels.
    bool same() const { return image < 4 && pixel < 4.8; }
};
Apart apart(const std::vector<RunningStats>& met, const std::vector<RunningStats>& sampled) {
    constexpr double kFew = 50, kBrightest = 130;  // of all lamps' luminances; rays that hit them
    Apart most;
    double rest = 0, rest_error2 = 0;
    for (std::size_t i = 0; i < met.size(); ++i) {
        const double difference = met[i].mean() - sampled[i].mean();
        const double error2 = sqr(met[i].standard_error()) + sqr(sampled[i].standard_error());
        if (std::fabs(sampled[i].mean()) * static_cast<double>(met[i].count()) < kFew * kBrightest) {
            rest += difference, rest_error2 += error2;
        } else {
            most.pixel = std::max(most.pixel, std::fabs(difference) / std::sqrt(error2));
        }
    }
    if (rest != 0) most.pixel = std::max(most.pixel, std::fabs(rest) / std::sqrt(rest_error2));
    const OfImage of_met = image_of(met), of_sampled = image_of(sampled);
    most.image = std::fabs(of_met.mean - of_sampled.mean) / std::hypot(of_met.error, of_sampled.error);
    return most;
}

double variance_of(const std::vector<RunningStats>& pixels) {
    double sum = 0;
    for (const RunningStats& pixel : pixels) sum += pixel.variance();
    return sum;
}

// ---- Means ----

struct View {
    std::string name;
    FilterSettings filter = {};
    float lens = 0;  // radius
    bool fog = false;
};
std::vector<View> views() {
    return {{"box"},
            {"wide triangle", filter_of(FilterSettings::Kind::triangle, 1.5F)},
            {"mitchell", filter_of(FilterSettings::Kind::mitchell, 2)},
            {"lens", {}, 0.05F},
            {"fog", {}, 0, true},
            {"lens, mitchell and fog", filter_of(FilterSettings::Kind::mitchell, 2), 0.05F, true}};
}

TEST(SmallLamps, Nightly_MeansOfPixels_AreThoseOfRaysThatMeetThemByChance) {
    constexpr int kSampled = 4'000, kMet = 30'000;
    for (const View& view : views()) {
        SCOPED_TRACE(view.name);
        Job job = job_of(market({0, view.fog}));
        job.film.filter = view.filter;
        job.camera = with_lens(job.camera, view.lens, 4);
        const SmallLamps lamps(job);
        EXPECT_EQ(lamps.size(), 12U);  // ten balls, two of the quads
        const auto met = pixels_of(job, nullptr, 1, kMet);
        const auto sampled = pixels_of(job, &lamps, 2, kSampled);
        const Apart found = apart(met, sampled);
        EXPECT_TRUE(found.same()) << found.image << ' ' << found.pixel;
        EXPECT_LT(variance_of(sampled), 0.2 * variance_of(met));

        // The test must detect a Jacobian that lacks a cosine.
        const auto without_cosine =
            pixels_of(job, &lamps, 2, kSampled, [](const SampleAccount& account, const Ray& ray) {
                return emission_alone(account, ray) * ray.d.z;
            });
        EXPECT_FALSE(apart(met, without_cosine).same());
        // The test must detect two exchanged pixels.
        auto exchanged = sampled;
        std::swap(exchanged[0], *std::ranges::max_element(exchanged, {}, &RunningStats::mean));
        EXPECT_FALSE(apart(met, exchanged).same());
    }
}

std::vector<IntegratorSettings> methods() {
    PhotonMapSettings maps;
    maps.photons = 2'000;
    maps.precompute = 0;
    IgiSettings igi;
    igi.nlights = 4;
    igi.nsets = 4;
    ProgressiveSettings progressive;
    progressive.photons = 2'000;
    return {PathSettings{}, DirectSettings{}, maps, igi, progressive};
}

TEST(SmallLamps, Long_OfEveryMethod_AreSeenOnce) {
    for (const bool fog : {false, true}) {
        for (const IntegratorSettings& method : methods()) {
            SCOPED_TRACE(integrator_name(method));
            const Job job = job_of(market({0.5F, fog}), method);
            const SmallLamps lamps(job);
            const Apart found = apart(pixels_of(job, nullptr, 1, 3'000), pixels_of(job, &lamps, 2, 500));
            EXPECT_TRUE(found.same()) << found.image << ' ' << found.pixel << ' ' << fog;
        }
    }
}

// A mirror and a pane in front of lamps: paths render the lamps' reflections and refractions as usual.
TEST(SmallLamps, SeenInAMirrorAndThroughGlass_StayAsTheyAre) {
    SceneMaker make;
    make.quad({-4, -4, 5}, {0, 8, 0}, {4, 0, 0}, make.material(MirrorMaterial{}));
    make.sphere({1.5F, 0, 4}, 1, make.material(DielectricMaterial{}));
    ball(make, {-0.7F, 0.5F, 3}, 0.06F, Rgb(40));
    ball(make, {1.5F, 0.2F, 6}, 0.08F, Rgb(40));
    const Job job = job_of(make.build());
    const SmallLamps lamps(job);
    EXPECT_EQ(lamps.size(), 2U);
    const Apart found = apart(pixels_of(job, nullptr, 1, 30'000), pixels_of(job, &lamps, 2, 30'000));
    EXPECT_TRUE(found.same()) << found.image << ' ' << found.pixel;
}

// ---- Closed forms ----

// Returns a pixel's area on the plane z = 1, for an image of `size` pixels and 80 degrees.
double pixel_area(int size) {
    return sqr(2 * std::tan(40 * kPiD / 180) / size);
}

// Expects the sum of the pixels to be the radiance times the lamp's area on the film.
void expect_sum(const Job& job, double expected) {
    const SmallLamps lamps(job);
    ASSERT_GT(lamps.size(), 0U);
    const auto pixels = pixels_of(job, &lamps, 5, 2'000);
    const OfImage of = image_of(pixels);
    const auto count = static_cast<double>(pixels.size());
    const auto off = [&](double truth) { return std::fabs(of.mean * count - truth); };
    EXPECT_LT(of.error * count, 5e-3 * expected);
    EXPECT_LT(off(expected), 4 * of.error * count + 1e-6 * expected) << of.mean * count << ' ' << expected;
    // The test must detect a Jacobian with one cosine less or more: at the centre of the field, 25 degrees
    // off-axis, it is 0.9.
    EXPECT_GT(off(0.9 * expected), 4 * of.error * count);
}

// The image of a sphere on the plane z = 1 is an ellipse: a cone of half-angle a at the angle t from the axis
// gives the semiaxes sin a cos a / (cos² t - sin² a) and sin a / sqrt(cos² t - sin² a).
TEST(SmallLamps, SumOfPixelsOfABall_IsItsRadianceTimesItsArea) {
    for (const float radius : {0.001F, 0.01F, 0.06F}) {
        const V3f centre(1.5F, 1, 4);
        SceneMaker make;
        ball(make, centre, radius, Rgb(100));
        const double d2 = V3d(centre).length2(), sin2 = sqr(double{radius}) / d2;
        const double apart2 = sqr(double{centre.z}) / d2 - sin2;
        const double area = kPiD * sin2 * std::sqrt(1 - sin2) / std::pow(apart2, 1.5);
        expect_sum(job_of(make.build()), 100 * area / pixel_area(kSize));
    }
}

// The image of a quadrilateral is that of its corners.
TEST(SmallLamps, SumOfPixelsOfAQuad_IsItsRadianceTimesItsArea) {
    for (const float size : {0.001F, 0.1F}) {
        const V3f corner(1.5F, 1, 4), a(0, size, 0.5F * size), b(size, 0, 0.3F * size);
        SceneMaker make;
        make.quad_light(corner, a, b, make.diffuse(Rgb(0)), Rgb(100));
        const auto at = [&](const V3f& p) { return Imath::V2d(V3d(p).x / V3d(p).z, V3d(p).y / V3d(p).z); };
        const Imath::V2d p[] = {at(corner), at(corner + a), at(corner + a + b), at(corner + b)};
        double twice = 0;
        for (int i = 0; i < 4; ++i) twice += p[i].x * p[(i + 1) % 4].y - p[i].y * p[(i + 1) % 4].x;
        expect_sum(job_of(make.build()), 100 * std::fabs(twice) / 2 / pixel_area(kSize));
    }
}

// ---- Which lamps are small ----

std::size_t taken(const std::function<void(SceneMaker&)>& add, const std::function<void(Job&)>& change = {}) {
    SceneMaker make;
    add(make);
    Job job = job_of(make.build());
    if (change) change(job);
    return SmallLamps(job).size();
}

TEST(SmallLamps, AreTaken_IfTheyAreSmallAndMetByRays) {
    const auto one = [](SceneMaker& make) { ball(make, {0.5F, 0.5F, 4}, 0.05F, Rgb(1)); };
    EXPECT_EQ(taken(one), 1U);
    // Lamps as large as pixels, behind the lens or at it, or outside the picture are not sampled.
    EXPECT_EQ(taken([](SceneMaker& make) { ball(make, {0.5F, 0.5F, 4}, 0.6F, Rgb(1)); }), 0U);
    EXPECT_EQ(taken([](SceneMaker& make) { ball(make, {0.5F, 0.5F, -4}, 0.05F, Rgb(1)); }), 0U);
    EXPECT_EQ(taken([](SceneMaker& make) { ball(make, {0, 0, 0.1F}, 0.05F, Rgb(1)); }), 0U);
    EXPECT_EQ(taken([](SceneMaker& make) { ball(make, {40, 0, 4}, 0.05F, Rgb(1)); }), 0U);
    // Lamps that face away, that rays do not see or see only partly, or that are not surfaces are not
    // sampled.
    EXPECT_EQ(taken([](SceneMaker& make) {
                  make.quad_light({0, 0, 4}, {0.1F, 0, 0}, {0, 0.1F, 0}, make.diffuse(Rgb(0)), Rgb(1));
              }),
              0U);
    const SphereEmitter sphere{{0.5F, 0.5F, 4}, 0.05F};
    EXPECT_EQ(taken([&](SceneMaker& make) {
                  make.light(make_unseen_light(make_area_light(sphere, Rgb(1), false)));
              }),
              0U);
    EXPECT_EQ(taken([&](SceneMaker& make) {
                  const auto light = make.light(make_area_light(sphere, Rgb(1), false));
                  Quadric& shape = make.sphere(sphere.centre, sphere.radius, make.diffuse(Rgb(0)));
                  shape.traits.light = light;
                  shape.traits.alpha = std::make_shared<const FloatTexture>(FloatTexture::constant(0.5F));
              }),
              0U);
    EXPECT_EQ(taken([&](SceneMaker& make) { make.light(make_area_light(sphere, Rgb(1), false)); }), 0U);
    EXPECT_EQ(taken([](SceneMaker& make) { make.light(make_point_light({0, 0, 4}, Rgb(1))); }), 0U);
    // Other cameras, an image that does not show lamps, and a lens that blurs the lamp over pixels exclude
    // sampling.
    const auto of_camera = [&](Camera::Settings::Kind kind, float lens) {
        return taken(one, [&](Job& job) {
            Camera::Settings settings = job.camera.settings();
            settings.kind = kind;
            settings.lens_radius = lens;
            settings.focal_distance = 1;
            job.camera = Camera(settings);
        });
    };
    EXPECT_EQ(of_camera(Camera::Settings::Kind::perspective, 0.02F), 1U);
    EXPECT_EQ(of_camera(Camera::Settings::Kind::perspective, 0.5F), 0U);
    EXPECT_EQ(of_camera(Camera::Settings::Kind::orthographic, 0), 0U);
    EXPECT_EQ(of_camera(Camera::Settings::Kind::spherical, 0), 0U);
    EXPECT_EQ(taken(one, [](Job& job) { job.integrator = PathSettings{.quantity = Quantity::illuminance}; }),
              0U);
}

// The projection inverts the camera ray, and its Jacobian agrees with finite differences.
TEST(SmallLamps, ProjectionOfTheCamera_IsTheInverseOfItsRays) {
    const Camera pinhole = testing::camera({1, 2, 3}, {2, 2.5F, 5}, 60, 40, 70);
    Camera::Settings mirrored = pinhole.settings();
    mirrored.screen[0] = 1, mirrored.screen[1] = -1.5F, mirrored.screen[2] = -1, mirrored.screen[3] = 1;
    for (const Camera& camera :
         {pinhole, with_lens(pinhole, 0.3F, 4), with_lens(Camera(mirrored), 0.3F, 4)}) {
        Sampler sampler(1, Purpose::test, 0, 0);
        for (int i = 0; i < 200; ++i) {
            const V2f film = sampler.next2() * V2f(60, 40), lens = sampler.next2();
            const Ray ray = camera.ray(film, lens);
            EXPECT_LT((camera.lens_point(lens) - ray.o).length(), 1e-6F);
            const auto seen = camera.project(lens, ray.d);
            ASSERT_TRUE(seen);
            EXPECT_LT((seen->film - film).length(), 1e-4F);
            EXPECT_FALSE(camera.project(lens, -ray.d));
            const float step = 0.1F;
            const V3f dx = camera.ray(film + V2f(step, 0), lens).d - camera.ray(film - V2f(step, 0), lens).d;
            const V3f dy = camera.ray(film + V2f(0, step), lens).d - camera.ray(film - V2f(0, step), lens).d;
            const float solid_angle = dx.cross(dy).length() / (4 * step * step);
            EXPECT_NEAR(seen->pixels2_per_sr * solid_angle, 1, 2e-3F);
        }
    }
}

TEST(SmallLamps, ValueOfAFilter_IsTheDensityOfItsSamples) {
    for (const auto kind :
         {FilterSettings::Kind::box, FilterSettings::Kind::triangle, FilterSettings::Kind::gaussian,
          FilterSettings::Kind::mitchell, FilterSettings::Kind::sinc}) {
        const FilterSampler filter(filter_of(kind, 1.5F));
        // Compares within one cell, and over all cells.
        double within = 0, sampled = 0, all = 0;
        constexpr int kSteps = 600, kSamples = 200'000;
        for (int i = 0; i < kSteps; ++i) {
            for (int j = 0; j < kSteps; ++j) {
                const V2f at(1.5F * (2 * (static_cast<float>(i) + 0.5F) / kSteps - 1),
                             1.5F * (2 * (static_cast<float>(j) + 0.5F) / kSteps - 1));
                const double value = double{filter.value(at)} * sqr(3.0 / kSteps);
                all += value;
                if (at.x > 0.25F && at.x < 0.5F && at.y > -1.25F && at.y < -0.5F) within += value;
            }
        }
        for (int i = 0; i < kSamples; ++i) {
            Sampler sampler = Sampler::stratified(1, Purpose::test, 0, static_cast<std::uint32_t>(i));
            const auto [at, weight] = filter.sample(sampler.next2());
            if (at.x > 0.25F && at.x < 0.5F && at.y > -1.25F && at.y < -0.5F)
                sampled += double{weight} / kSamples;
        }
        EXPECT_NEAR(all, 1, 1e-3);
        EXPECT_NEAR(within, sampled, 1e-3);
        EXPECT_EQ(filter.value({1.6F, 0}), 0);
    }
}

// ---- The image ----

RenderResult rendered(const Job& job, int threads = 2, const Checkpoint* from = nullptr,
                      Checkpoint* kept = nullptr) {
    Monitor silent;
    RenderOptions options{7, Workers{threads}};
    if (kept) options.keep = [kept](Checkpoint checkpoint) { *kept = std::move(checkpoint); };
    options.resume = from;
    return render(job, options, silent);
}

TEST(SmallLamps, InAnImage_AreTheSameForAnyThreadsAfterResumeAndCutOut) {
    for (const IntegratorSettings& method : methods()) {
        for (const bool halves : {false, true}) {
            SCOPED_TRACE(integrator_name(method));
            Job job = job_of(market({0.5F, false}), method, 40);
            job.film.filter = filter_of(FilterSettings::Kind::gaussian, 1.5F);
            job.film.two_halves = job.film.adaptive = halves;
            ASSERT_GT(SmallLamps(job).size(), 5U);
            const Image image = rendered(job).image;
            EXPECT_EQ(rendered(job, 1).image.data, image.data);
            Checkpoint kept;
            job.spp = 8;
            rendered(job, 2, nullptr, &kept);
            job.spp = 16;
            EXPECT_EQ(rendered(job, 3, &kept).image.data, image.data);
        }
    }
    // Renders without maps and sets of lights, which depend on the visible region.
    Job job = job_of(market({0.5F, false}), PathSettings{}, 40);
    const Image image = rendered(job).image;
    job.film.crop_begin = {13, 5}, job.film.crop_end = {37, 31};
    const Image part = rendered(job).image;
    for (int y = 0; y < part.height; ++y) {
        for (int x = 0; x < part.width; ++x) EXPECT_EQ(part.rgb_at(x, y), image.rgb_at(x + 13, y + 5));
    }
}

}  // namespace small_lamps_test
}  // namespace lucerna
