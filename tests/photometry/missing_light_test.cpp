// Light paths find light that paths from a receiver cannot: that of lamps too small to be met over mirrors
// and solid glass. For an image they state how much is missing. Light that paths meet must never be reported
// as missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/pbrt/read_scene.h"
#include "engine/photometry/illuminance.h"
#include "engine/photometry/path_rounds.h"
#include "engine/render/chance_light.h"
#include "engine/scene/path_limits.h"

namespace lucerna {
namespace missing_light_test {

using ::testing::IsEmpty;

struct Listener : Monitor {
    std::vector<std::string> warnings;
    void warn(std::string_view line) override { warnings.emplace_back(line); }
};

Job job_of(const std::string& world) {
    Monitor silent;
    return read_scene_text(
        "LookAt 0 -0.5 0.4  0 0.5 2  0 0 1 Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 64 "
        "\"integer yresolution\" 64 WorldBegin\n" +
            world,
        "scene.pbrt", {}, Workers{2}, silent);
}

// Returns a plane of `size` at z = 2 that faces down to z = 0.
CalculationSurface ceiling(double size, int points) {
    CalculationSurface surface;
    surface.name = "plane";
    surface.corner = {-size / 2, -size / 2, 2};
    surface.u = {size, 0, 0};
    surface.v = {0, size, 0};
    surface.normal = surface.up = {0, 0, -1};
    surface.points = V2i(points);
    return surface;
}

SurfaceIlluminance measure(const std::string& world, const CalculationSurface& surface, Listener& listener,
                           std::uint64_t seed = 1) {
    IlluminanceOptions options;
    options.workers = {2};
    options.seed = seed;
    return illuminance_on(std::vector{surface}, job_of(world), options, listener).surfaces.front();
}

constexpr double kRadius = 0.002, kL = 1e5, kHeight = 2;
const std::string kLamp =
    "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" \"rgb L\" "
    "[1e5 "
    "1e5 1e5] Shape \"disk\" \"float radius\" 0.002 AttributeEnd\n";
const std::string kGround =
    "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] Translate 0 0 2.5 Shape \"disk\" "
    "\"float "
    "radius\" 4 AttributeEnd\n";
// A sheet of solid glass with its outside up and down.
const std::string kSlab =
    "AttributeBegin Material \"dielectric\" \"float eta\" 1.5 Translate 0 0 0.05 AttributeBegin "
    "ReverseOrientation "
    "Shape \"disk\" \"float radius\" 2 AttributeEnd Translate 0 0 0.006 Shape \"disk\" \"float radius\" 2 "
    "AttributeEnd\n";

double on_axis() {  // a disc of radius r, h below
    return kPiD * kL * kRadius * kRadius / (kRadius * kRadius + kHeight * kHeight);
}

TEST(MissingLight, Long_SmallLampBehindSolidGlass_IsFoundByLightPaths) {
    Listener listener;
    const SurfaceIlluminance found = measure(kLamp + kGround + kSlab, ceiling(0.02, 1), listener);
    // The light on the axis goes straight on, reduced by what both faces and all bounces between them
    // reflect, and the glass shortens the optical distance by 6 mm (1 - 1/1.5).
    const double f = 0.04, truth = on_axis() * (1 - 2 * f / (1 + f)) * std::pow(2 / (2 - 0.002), 2);
    EXPECT_NEAR(found.never_met, truth, 0.05 * truth);
    EXPECT_NEAR(found.mean.value, truth, 1.5 * found.mean.half_width);
    EXPECT_LE(found.mean.half_width, 0.02 * truth);
    EXPECT_DOUBLE_EQ(found.points[0].indirect.value, found.mean.value);
    EXPECT_DOUBLE_EQ(found.points[0].mirrored, found.mean.value);
    EXPECT_THAT(listener.warnings, IsEmpty());
}

TEST(MissingLight, PointLightOverAMirror_IsThatOfItsImage) {
    Listener listener;
    const std::string mirror =
        "AttributeBegin Material \"conductor\" \"rgb reflectance\" [1 1 1] Translate 0 0 -1 Shape \"disk\" "
        "\"float radius\" 3 AttributeEnd\n";
    const SurfaceIlluminance found = measure(
        "LightSource \"point\" \"rgb I\" [100 100 100]\n" + kGround + mirror, ceiling(0.02, 1), listener);
    EXPECT_NEAR(found.direct, 100.0 / 4, 0.01);
    EXPECT_NEAR(found.never_met, 100.0 / 16, 0.05 * 100 / 16);
    EXPECT_NEAR(found.mean.value, 100.0 / 4 + 100.0 / 16, 1.5 * found.mean.half_width);
    EXPECT_LE(found.mean.half_width, 0.02 * (100.0 / 4 + 100.0 / 16));
    EXPECT_THAT(listener.warnings, IsEmpty());
}

TEST(MissingLight, BehindAPane_NothingIsMissing) {
    Listener listener;
    const std::string pane =
        "AttributeBegin Material \"thindielectric\" Translate 0 0 0.05 Shape \"disk\" \"float radius\" 2 "
        "AttributeEnd\n";
    const SurfaceIlluminance found = measure(kLamp + kGround + pane, ceiling(0.02, 1), listener);
    const double truth = on_axis() * (1 - 2 * 0.04 / 1.04);
    EXPECT_NEAR(found.mean.value, truth, std::max(2 * found.mean.half_width, 1e-3 * truth));
    EXPECT_EQ(found.never_met, 0);
    EXPECT_THAT(listener.warnings, IsEmpty());
}

// The lamp is large enough to be met, over a mirror and behind glass.
TEST(MissingLight, Long_LampThatPathsMeet_IsNotCalledMissing) {
    const std::string world =
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" \"rgb "
        "L\" [10 "
        "10 10] Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n"
        "AttributeBegin Material \"conductor\" \"rgb reflectance\" [1 1 1] Translate 1.5 0 0 Rotate -90 0 1 "
        "0 "
        "Shape \"disk\" \"float radius\" 3 AttributeEnd\n" +
        kGround + kSlab;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        Listener listener;
        const SurfaceIlluminance found = measure(world, ceiling(1, 2), listener, seed);
        EXPECT_GT(found.mean.value, 0);
        EXPECT_EQ(found.never_met, 0) << seed;
        EXPECT_THAT(listener.warnings, IsEmpty()) << seed;
    }
}

// Returns the missing share of an image by the path tracer.
double missing_share(const std::string& world, std::int64_t chains = 0) {
    Job job = job_of(world);
    PathSettings path;
    path.chains = chains;
    job.integrator = path;
    job.spp = 16;
    job.film.chance = true;
    Monitor silent;
    RenderOptions options;
    options.workers = {2};
    const ChanceLight there =
        chance_light_in_view(job, {job.scene, 1, most_bounces(0), options.workers, silent});
    const MissingInImage missing = missing_in(job, render(job, options, silent), there);
    return missing.missing > 0 ? missing.share() : 0;
}

TEST(MissingLight, InAnImage_IsItsShare) {
    const std::string wall =
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] Translate 0 0 2 Shape "
        "\"disk\" "
        "\"float radius\" 8 AttributeEnd\n";
    EXPECT_GT(missing_share(kLamp + kSlab + wall), 0.9);
    EXPECT_EQ(missing_share(kLamp + kSlab + wall, PathSettings().chains), 0) << "it is searched for";
    EXPECT_EQ(missing_share(kLamp + wall), 0);
    const std::string large =
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" \"rgb "
        "L\" [10 "
        "10 10] Shape \"disk\" \"float radius\" 0.5 AttributeEnd\n";
    EXPECT_EQ(missing_share(large + kSlab + wall), 0);
}

TEST(MissingLight, FewerThanTheStandardErrorsAsked_IsNothing) {
    EXPECT_EQ(missing_light({10, 1}, {0, 0}, 4), 10);
    EXPECT_EQ(missing_light({10, 1}, {5, 1}, 4), 0);
    EXPECT_EQ(missing_light({1, 0}, {2, 0}, 4), 0);
}

TEST(Forecast, OfHours_EndsTheComputation) {
    using enum Forecast::Verdict;
    EXPECT_EQ(forecast(20, 0.04, 0.02).verdict, go_on);    // one more minute
    EXPECT_EQ(forecast(20, 0.10, 0.02).verdict, tell);     // eight minutes
    EXPECT_DOUBLE_EQ(forecast(20, 0.10, 0.02).left, 480);  // 20 (25 - 1)
    EXPECT_EQ(forecast(20, 1, 0.02).verdict, give_up);     // fourteen hours
    EXPECT_EQ(forecast(1, 1, 0.02).verdict, go_on);        // too early to tell
    EXPECT_EQ(forecast(20, INFINITY, 0.02).verdict, give_up);
}

}  // namespace missing_light_test
}  // namespace lucerna
