// Illuminance by light paths at the edges of reflected light, and points that are cut off from the light.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "engine/photometry/illuminance.h"
#include "engine/photometry/illuminance_text.h"
#include "tests/photometry/stated_intervals.h"

namespace lucerna {
namespace light_paths_at_test {

using namespace lucerna::testing;

struct Listener : Monitor {
    int warnings = 0;
    void warn(std::string_view /*line*/) override { ++warnings; }
};

std::string quad(const std::string& corners) {
    return "Shape \"bilinearmesh\" \"point3 P\" [" + corners + "]\n";
}
// Returns the six sides of a box along the axes.
std::string box(double x0, double x1, double y0, double y1, double z0, double z1) {
    std::string sides;
    for (const double z : {z0, z1})
        sides += quad(fmt::format("{0} {2} {4}  {1} {2} {4}  {0} {3} {4}  {1} {3} {4}", x0, x1, y0, y1, z));
    for (const double y : {y0, y1})
        sides += quad(fmt::format("{0} {4} {2}  {1} {4} {2}  {0} {4} {3}  {1} {4} {3}", x0, x1, z0, z1, y));
    for (const double x : {x0, x1})
        sides += quad(fmt::format("{4} {0} {2}  {4} {1} {2}  {4} {0} {3}  {4} {1} {3}", y0, y1, z0, z1, x));
    return sides;
}

// A disc of radius 0.5 mirrors a point of 100 cd that is 1 m above it. From its image the light of a disc of
// radius 2 falls on the plane 2 m above the point, where it ends at a sharp edge. Points lie on both sides of
// the edge, at a tenth of a point's largest radius.
TEST(LightPathsAt, Long_AtTheEdgeOfReflectedLight_TheIntervalHoldsTheClosedForm) {
    constexpr double kI = 100, kEdge = 2, kFirst = 1.8, kLast = 2.2, kPrecision = 0.05;
    const std::string world =
        "LightSource \"point\" \"rgb I\" [100 100 100]\n"
        "AttributeBegin Material \"conductor\" \"rgb reflectance\" [1 1 1] Translate 0 0 -1 Shape \"disk\" "
        "\"float radius\" 0.5 AttributeEnd\n";
    CalculationSurface surface = plane(2, kLast - kFirst, {10, 1});
    surface.corner = {kFirst, -0.001, 2};
    surface.v = {0, 0.002, 0};
    surface.normal = surface.up = {0, 0, -1};
    const auto below = [](double x, double height) {
        return kI * height / std::pow(x * x + height * height, 1.5);
    };
    int missed = 0, of = 0;
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        Listener listener;
        IlluminanceOptions options;
        options.workers = {2};
        options.seed = seed;
        options.precision = kPrecision;
        options.seconds = 600;  // without a limited time, light paths end before they are so precise
        const SurfaceIlluminance found =
            illuminance_on(std::vector{surface}, job_of(world), options, listener).surfaces.front();
        EXPECT_EQ(listener.warnings, 0);
        for (int i = 0; i < surface.points.x; ++i) {
            const double x = surface.position(i, 0).x;
            const double truth = below(x, 2) + (x < kEdge ? below(x, 4) : 0.0);
            const Reading95& reading = found.at(i, 0).all;
            EXPECT_NEAR(reading.value, truth, 2 * kPrecision * truth) << x;
            EXPECT_LE(reading.half_width, kPrecision * std::max(found.mean.value, reading.value)) << x;
            missed += std::fabs(reading.value - truth) > reading.half_width + 1e-5 * truth;
            ++of;
        }
    }
    EXPECT_TRUE(as_stated({missed, of})) << missed << " of " << of;
}

const std::string kWhite = "Material \"diffuse\" \"rgb reflectance\" [0.7 0.7 0.7]\n";

TEST(CutOffPoints, InsideFurniture_DoNotCount) {
    // A closed chest of 1 m in a room of 4 m.
    const std::string world = kWhite + box(-2, 2, -2, 2, 0, 2.6) + box(0.5, 1.5, 0.5, 1.5, 0.01, 1) +
                              "LightSource \"point\" \"point3 from\" [-1 -1 2.2] \"rgb I\" [100 100 100]\n";
    const CalculationSurface surface = plane(0.5, 4, {8, 8});
    const IlluminanceReport report = measure(job_of(world), surface, 4);
    const SurfaceIlluminance& found = report.surfaces.front();
    int inside = 0;
    double mean = 0;
    for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
            const V3d p = surface.position(x, y);
            const bool is_inside = p.x > 0.5 && p.x < 1.5 && p.y > 0.5 && p.y < 1.5;
            inside += is_inside;
            EXPECT_EQ(found.at(x, y).is_cut_off(), is_inside) << x << ' ' << y;
            if (!is_inside) mean += found.at(x, y).all.value / (64 - 4);
        }
    }
    EXPECT_EQ(inside, 4);
    EXPECT_EQ(found.cut_off(), 4U);
    EXPECT_NEAR(found.mean.value, mean, 1e-9 * mean);
    EXPECT_GT(found.least.value, 0);
    EXPECT_NE(illuminance_text(report).find("4 of 64 points"), std::string::npos);
    EXPECT_NE(illuminance_csv(report).find(",0.5,,,,\n"), std::string::npos);
}

TEST(CutOffPoints, InShadow_Count) {
    const std::string world = "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" +
                              quad("-3 -3 -0.1  3 -3 -0.1  -3 3 -0.1  3 3 -0.1") +
                              quad("0.2 -3 0.1  0.2 3 0.1  0.2 -3 2  0.2 3 2") +
                              "LightSource \"point\" \"point3 from\" [-0.5 0 1] \"rgb I\" [100 100 100]\n";
    const SurfaceIlluminance found = measure(world, plane(0.5, 2, {4, 4}), 4).surfaces.front();
    EXPECT_EQ(found.cut_off(), 0U);
    EXPECT_EQ(found.least.value, 0);
}

}  // namespace light_paths_at_test
}  // namespace lucerna
