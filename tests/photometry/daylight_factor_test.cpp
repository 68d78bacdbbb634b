// Daylight factors of a black room with a window, whose closed forms follow from the sky's luminance.
#include "engine/photometry/daylight_factor.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/photometry/stated_intervals.h"
#include "tests/support/panes.h"

namespace lucerna {
namespace daylight_factor_test {

using namespace lucerna::testing;

// The window is the rectangle -1.5 <= x <= 1.5, 0 <= z <= 2 of the plane y = -2.5. The points lie at its
// sill, on y from -1.5 to 1.5.
constexpr double kHalf = 1.5, kHead = 2, kWall = -2.5;
constexpr double kIndex = 1.52, kTransmittance = 0.7;

std::string quad(const std::string& corners) {
    return "Shape \"bilinearmesh\" \"point3 P\" [" + corners + "]\n";
}
std::string room(const std::string& sky, bool glazed) {
    const std::string black = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
    const std::string box =
        quad("-3 -2.5 3  3 -2.5 3  -3 2.5 3  3 2.5 3") + quad("-3 2.5 -1  3 2.5 -1  -3 2.5 3  3 2.5 3") +
        quad("-3 -2.5 -1  -3 2.5 -1  -3 -2.5 3  -3 2.5 3") + quad("3 -2.5 -1  3 2.5 -1  3 -2.5 3  3 2.5 3") +
        quad("-3 -2.5 -1  3 -2.5 -1  -3 2.5 -1  3 2.5 -1");
    const std::string wall = quad("-3 -2.5 -1  3 -2.5 -1  -3 -2.5 0  3 -2.5 0") +
                             quad("-3 -2.5 2  3 -2.5 2  -3 -2.5 3  3 -2.5 3") +
                             quad("-3 -2.5 0  -1.5 -2.5 0  -3 -2.5 2  -1.5 -2.5 2") +
                             quad("1.5 -2.5 0  3 -2.5 0  1.5 -2.5 2  3 -2.5 2");
    const std::string pane =
        fmt::format("Material \"thindielectric\" \"float eta\" {} \"float transmittance\" {}\n", kIndex,
                    kTransmittance) +
        quad("-3 -2.51 -0.5  3 -2.51 -0.5  -3 -2.51 3  3 -2.51 3");
    return sky + black + box + wall + (glazed ? pane : "");
}
std::string sky(const std::string& type, const std::string& more = "") {
    return fmt::format("LightSource \"sky\" \"string type\" \"{}\" {}\n", type, more);
}

CalculationSurface points(int count) {
    CalculationSurface surface = plane(0, 3, {1, count});
    surface.corner = {-0.01, -1.5, 0};
    surface.u = {0.02, 0, 0};
    return surface;
}

SurfaceIlluminance factors_in(const std::string& world, int samples, std::uint64_t seed = 0) {
    SceneOverrides overrides;
    overrides.without_sun = true;
    Monitor silent;
    Job job = read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world, "scene.pbrt",
                              overrides, Workers{2}, silent);
    const double outside = sky_illuminance(job.scene);
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = samples;
    options.seed = seed;
    return daylight_factors(illuminance_on(std::vector{points(12)}, std::move(job), options, silent), outside)
        .surfaces[0];
}

// The factor of the opening under the uniform sky: the configuration factor of a rectangle that stands on the
// plane of the point, twice, as the point lies before its middle.
double under_uniform_sky(const V3d& p) {
    const double d = p.y - kWall, slant = std::hypot(d, kHead);
    return 100 / kPiD * (std::atan(kHalf / d) - d / slant * std::atan(kHalf / slant));
}

// The traditional overcast sky has L = (1 + 2 sin h)/3 and the horizontal illuminance 7π/9. The
// opening ends at the elevation tan γ = t cos φ above the azimuth φ, t = head / d. With ∫ sin² h cos h dh =
// sin³ γ / 3, its second part is 2/3 ∫ sin³ γ dφ, whose antiderivative in s = sin φ is asin u - v / (1 + t²),
// u = t s / sqrt(1 + t²), v = u / sqrt(1 - u²).
double under_overcast_sky(const V3d& p) {
    const double d = p.y - kWall, t = kHead / d, whole = 1 + t * t;
    const double u = t / std::sqrt(whole) * kHalf / std::hypot(kHalf, d);
    const double v = u / std::sqrt(1 - u * u);
    const double squared = 2.0 / 3 * (std::asin(u) - v / whole);  // ∫ sin h cos Z dω, cos Z = sin h
    return 100 * (under_uniform_sky(p) / 100 * kPiD + 2 * squared) / 3 / (7 * kPiD / 9);
}

// The pane's share has no closed form: the midpoint rule over the opening.
double behind_pane(const V3d& p, bool overcast, double inside) {
    constexpr int kSteps = 100;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const V3d way = V3d((2 * (i + 0.5) / kSteps - 1) * kHalf, kWall, (j + 0.5) / kSteps * kHead) - p;
            const V3d w = way.normalized();
            const double luminance = overcast ? (1 + 2 * w.z) / (7 * kPiD / 3) : 1 / kPiD;
            sum += w.z * -w.y / way.length2() * luminance * pane_sums(-w.y, kIndex, inside).transmitted;
        }
    }
    return 100 * sum * 2 * kHalf * kHead / (kSteps * kSteps);
}
// Returns the transmittance from face to face with which the pane as a whole has kTransmittance, by
// bisection.
double inside_pane() {
    double low = 0, high = 1;
    for (int i = 0; i < 60; ++i) {
        const double middle = (low + high) / 2;
        (pane_sums(1, kIndex, middle).transmitted < kTransmittance ? low : high) = middle;
    }
    return low;
}

// The error of the tabulated sky, whose texels subtend 0.35°.
constexpr double kTable = 2e-4;

TEST(DaylightFactor, BehindAnOpening_EqualsClosedForms) {
    expect_as_stated(factors_in(room(sky("cie-5"), false), 16), under_uniform_sky, kTable);
    const SurfaceIlluminance overcast = factors_in(room(sky("cie-16"), false), 16);
    expect_as_stated(overcast, under_overcast_sky, kTable);
    EXPECT_FALSE(as_stated(misses(overcast, under_uniform_sky))) << "the factors of another sky are refused";
    EXPECT_LT(overcast.mean.half_width, 0.01 * overcast.mean.value);
}

TEST(DaylightFactor, Long_BehindAPane_HasItsTransmittanceByDirection) {
    const double inside = inside_pane();
    for (const bool is_overcast : {false, true}) {
        const SurfaceIlluminance found = factors_in(room(sky(is_overcast ? "cie-16" : "cie-5"), true), 96);
        expect_as_stated(
            found, [&](const V3d& p) { return behind_pane(p, is_overcast, inside); }, kTable);
        const auto by_normal_incidence = [&](const V3d& p) {
            return kTransmittance * (is_overcast ? under_overcast_sky(p) : under_uniform_sky(p));
        };
        EXPECT_FALSE(as_stated(misses(found, by_normal_incidence)))
            << "one transmittance for all directions is refused";
    }
}

TEST(DaylightFactor, Intervals_CoverTheClosedFormAsOftenAsStated) {
    constexpr int kSeeds = 16;
    int missed = 0, by_half = 0, of = 0, means = 0;
    double truth = 0;
    for (int i = 0; i < 12; ++i) truth += under_overcast_sky(points(12).position(0, i)) / 12;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const SurfaceIlluminance found =
            factors_in(room(sky("cie-16"), false), 1, static_cast<std::uint64_t>(seed));
        const auto [out, all] = misses(found, under_overcast_sky, 1, kTable);
        missed += out;
        by_half += misses(found, under_overcast_sky, 0.5, kTable).first;
        of += all;
        means += std::fabs(found.mean.value - truth) > found.mean.half_width + kTable * truth;
    }
    EXPECT_TRUE(as_stated({missed, of})) << missed << " of " << of;
    EXPECT_TRUE(as_stated({means, kSeeds})) << means << " means of " << kSeeds;
    EXPECT_FALSE(as_stated({by_half, of})) << "intervals half as wide are refused";
}

// Far from all surfaces a horizontal plane has 100 %, whatever the sky and its sun.
TEST(DaylightFactor, Outdoors_IsAHundredPerCent) {
    const std::string sun =
        "\"vector3 sun\" [0.3 0.5 0.6] \"float sunilluminance\" 70000 \"float ground\" 0.3";
    for (const std::string& world :
         {sky("cie-1", sun), sky("cie-5"), sky("cie-12", sun), sky("cie-16"),
          sky("perez", sun + " \"float directirradiance\" 600 \"float diffuseirradiance\" 120"),
          std::string("LightSource \"infinite\" \"rgb L\" [3 3 3]\n")}) {
        const SurfaceIlluminance found =
            factors_in(world + "Translate 0 0 -50 Shape \"sphere\" \"float radius\" 0.1", 8);
        expect_as_stated(
            found, [](const V3d&) { return 100.0; }, kTable);
        EXPECT_LT(found.mean.half_width, 1) << world;
    }
}

}  // namespace daylight_factor_test
}  // namespace lucerna
