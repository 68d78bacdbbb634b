// Illuminance by light paths at the edges of reflected light, and points that are cut off from the light.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "engine/photometry/illuminance.h"
#include "engine/photometry/illuminance_text.h"
#include "engine/photometry/light_paths_at.h"
#include "tests/photometry/stated_intervals.h"
#include "tests/support/panes.h"

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

// A small lamp shines through a glass ball on the walls of a room, which light the points. Connections take
// the place of density estimates for nearly all of this light, and are more precise.
TEST(LightPathsAt, Long_Connections_AreThatOfDensityEstimatesWithLessNoise) {
    const std::string world =
        "Material \"diffuse\" \"rgb reflectance\" [0.7 0.5 0.3]\n" + box(-2, 2, -2, 2, 0, 2.6) +
        quad("-2 -2 0.8  -1 -2 0.8  -2 2 0.8  -1 2 0.8") +
        "AttributeBegin Translate 0.5 0 1.5 Material \"dielectric\" Shape \"sphere\" \"float radius\" 0.2 "
        "AttributeEnd\n"
        "LightSource \"point\" \"point3 from\" [0.5 0 2.2] \"rgb I\" [100 100 100]\n"
        "AttributeBegin Material \"thindielectric\" " +
        quad("-2 0 0  2 0 0  -2 0 2.6  2 0 2.6") + "AttributeEnd\n";
    Job job = job_of(world);
    std::vector<Receiver> receivers;
    std::vector<LightPathsAt::Reach> near, far;
    for (const ReceiverKind kind :
         {ReceiverKind::planar, ReceiverKind::cylindrical, ReceiverKind::spherical}) {
        const CalculationSurface surface = plane(0.4, 3.8, {3, 3}, kind);
        for (int i = 0; i < 9; ++i) {
            receivers.push_back(placed(surface.receiver(i % 3, i / 3), job.scene));
            near.push_back({0.1F, 0.1F, 0.4F});
            far.push_back({0.1F, 0.1F, 100});
        }
    }
    Monitor silent;
    const Workers workers{2};
    // Light by chains of specular surfaces alone is the same in both, and left out.
    struct Both {
        RunningStats connected, by_density;
    };
    std::vector<Both> found(receivers.size() + 1);  // the last of all receivers
    std::vector<std::size_t> all(receivers.size());
    std::iota(all.begin(), all.end(), 0U);
    for (std::uint64_t seed = 0; seed < 16; ++seed) {
        const ChanceLightWork work{job.scene, seed, 12, workers, silent};
        LightPathsAt connected(receivers, near, work), by_density(receivers, far, work);
        for (LightPathsAt* paths : {&connected, &by_density}) ASSERT_GT(paths->trace(1 << 18), 0);
        const auto light = [](const LightPathsAt& paths, std::span<const std::size_t> at) {
            const LightPathsAt::Mean mean = paths.mean(at);
            return mean.light.value - mean.seen.value;
        };
        for (std::size_t i = 0; i < found.size(); ++i) {
            const auto at = i < all.size() ? std::span(&all[i], 1) : std::span<const std::size_t>(all);
            found[i].connected.add(light(connected, at));
            found[i].by_density.add(light(by_density, at));
        }
    }
    double variance = 0, density_variance = 0;
    for (const auto& [connected, by_density] : found) {
        const double error = std::hypot(connected.standard_error(), by_density.standard_error());
        EXPECT_NEAR(connected.mean(), by_density.mean(), 4.5 * error);
        variance += connected.variance();
        density_variance += by_density.variance();
    }
    EXPECT_LT(variance, density_variance / 4);
    EXPECT_LT(found.back().by_density.standard_error(), 0.03 * found.back().by_density.mean())
        << "a seventh too much would be seen";
}

// A ball of 5 cm in the light of a lamp 10 m away, which sends it six millionths of its light. The point is
// in the ball's shadow, so that all of its light comes through the ball: paraxially, a thin lens at its
// centre.
TEST(LightPathsAt, Long_ThroughASmallBallFarFromTheLamp_TheLightIsFound) {
    constexpr double kRadius = 0.05, kIndex = 1.5, kBehind = 0.8, kIntensity = 5000;
    const V3d lamp(4, 0, 9), ball = kBehind * lamp.normalized();
    const std::string world =
        fmt::format("LightSource \"point\" \"point3 from\" [{0} {1} {2}] \"rgb I\" [{3} {3} {3}]\n", lamp.x,
                    lamp.y, lamp.z, kIntensity) +
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n" +
        quad("-0.5 -0.5 -0.01  0.5 -0.5 -0.01  -0.5 0.5 -0.01  0.5 0.5 -0.01") +
        fmt::format(
            "AttributeBegin Material \"dielectric\" \"float eta\" {} Translate {} {} {} Shape \"sphere\" "
            "\"float radius\" {} AttributeEnd\n",
            kIndex, ball.x, ball.y, ball.z, kRadius);
    constexpr double kFocal = kIndex * kRadius / (2 * (kIndex - 1)), kPassed = 0.96 * 0.96;
    const double before = (lamp - ball).length(), spread = 1 - kBehind * (1 / kFocal - 1 / before);
    const double truth = kPassed * kIntensity / sqr(before * spread) * lamp.normalized().z;
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
        Monitor silent;
        IlluminanceOptions options;
        options.workers = {2};
        options.seed = seed;
        options.most_samples = 4;
        const Reading95 found =
            illuminance_on(std::vector{plane(0, 1e-4, {1, 1})}, job_of(world), options, silent)
                .surfaces.front()
                .mean;
        EXPECT_NEAR(found.value, truth, 2 * found.half_width + 0.01 * truth);
        EXPECT_LT(found.half_width, 0.2 * truth);
    }
}

// A lens of two spherical caps between a lamp and points on its axis. Towards a point or from the sun, the
// illuminance on the axis follows from the ray transfer matrices of its faces. At the image of an even disc
// every ray through the lens comes from the disc, so the lens shines with the disc's luminance.
TEST(LightPathsAt, Long_OnTheAxisOfALens_TheLightIsThatOfTheMatrices) {
    constexpr double kRadius = 0.2, kRim = 0.04, kIndex = 1.5, kLamp = 0.5, kPassed = 0.96 * 0.96;
    const double centre = std::sqrt(sqr(kRadius) - sqr(kRim)), vertex = kRadius - centre;
    // Returns the height at `below` the lens of the ray that leaves the lamp's plane at this height and
    // slope.
    const auto arrives = [&](double height, double slope, double below) {
        height += (kLamp - vertex) * slope;
        slope = slope / kIndex - (kIndex - 1) / (kIndex * kRadius) * height;
        height += 2 * vertex * slope;
        slope = kIndex * slope - (kIndex - 1) / kRadius * height;
        return height + (below - vertex) * slope;
    };
    struct Case {
        std::string lamp;
        double below, truth;
    };
    constexpr double kStrength = 100, kDisc = 0.02, kImage = 0.333;
    std::vector<Case> cases;
    for (const double below : {0.15, 0.667, 1.2})
        cases.push_back(
            {fmt::format("LightSource \"point\" \"point3 from\" [0 0 {0}] \"rgb I\" [{1} {1} {1}]\n", kLamp,
                         kStrength),
             below, kPassed * kStrength / sqr(arrives(0, 1, below))});
    for (const double below : {0.1, 0.3, 1.0})
        cases.push_back({fmt::format("LightSource \"distant\" \"point3 from\" [0 0 1] \"point3 to\" [0 0 0] "
                                     "\"rgb L\" [{0} {0} {0}]\n",
                                     kStrength),
                         below, kPassed * kStrength / sqr(arrives(1, 0, below))});
    cases.push_back(
        {fmt::format("AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource "
                     "\"diffuse\" \"rgb L\" [{0} {0} {0}] Translate 0 0 {1} Rotate 180 1 0 0 Shape "
                     "\"disk\" \"float radius\" {2} AttributeEnd\n",
                     kStrength, kLamp, kDisc),
         kImage, kPassed * kStrength * kPiD * sqr(kRim) / (sqr(kRim) + sqr(kImage))});
    const std::string lens = fmt::format(
        "AttributeBegin Material \"dielectric\" \"float eta\" {0}\nTranslate 0 0 {1} Shape \"sphere\" "
        "\"float "
        "radius\" {2} \"float zmax\" -{1}\nTranslate 0 0 -{3} Shape \"sphere\" \"float radius\" {2} \"float "
        "zmin\" {1}\nAttributeEnd\n",
        kIndex, centre, kRadius, 2 * centre);
    for (const auto& [lamp, below, truth] : cases) {
        Listener listener;
        IlluminanceOptions options;
        options.workers = {2};
        options.seconds = 600;  // it stops at the precision
        options.precision = 0.02;
        const Reading95 found =
            illuminance_on(std::vector{plane(-below, 1e-6, {1, 1})}, job_of(lamp + lens), options, listener)
                .surfaces.front()
                .mean;
        // The faces reflect up to 0.2 % of the light twice, which is not in the closed form.
        EXPECT_NEAR(found.value, truth, 2 * found.half_width + 0.003 * truth) << lamp << below;
        EXPECT_LE(found.half_width, 0.02 * truth) << lamp << below;
        EXPECT_EQ(listener.warnings, 0) << lamp << below;
    }
}

// A spotlight shines through a window of thick glass into a white sphere, which is evenly lit but where the
// beam lands: E = ρ Φ T / A / (1 - ρ (1 - f (1 - R))), for a window of the share f of the sphere that
// reflects R of diffuse light back.
TEST(LightPathsAt, Long_InASphereWithAWindow_TheLightIsThatOfTheClosedForm) {
    constexpr double kReflectance = 0.8, kTop = 0.98, kInner = 2.9, kOuter = 3, kIntensity = 1000;
    const std::string world = fmt::format(
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [{0} {0} {0}] Shape \"sphere\" \"float "
        "radius\" 1 "
        "\"float zmax\" {1} AttributeEnd\nAttributeBegin Material \"dielectric\" Shape \"disk\" \"float "
        "height\" 1.02 "
        "\"float radius\" 0.3 ReverseOrientation Shape \"disk\" \"float height\" {1} \"float radius\" 0.3 "
        "AttributeEnd\nLightSource \"spot\" \"point3 from\" [0 0 2.5] \"point3 to\" [0 0 0] \"float "
        "coneangle\" {2} "
        "\"float conedeltaangle\" {3} \"rgb I\" [{4} {4} {4}]\n",
        kReflectance, kTop, kOuter, kOuter - kInner, kIntensity);
    const auto cosine = [](double degrees) { return std::cos(degrees * kPiD / 180); };
    const double flux = kIntensity * 2 * kPiD * (1 - (cosine(kInner) + cosine(kOuter)) / 2);
    constexpr int kSteps = 1000;
    double back = 0;  // of diffuse light, by the midpoint rule over cos²
    for (int i = 0; i < kSteps; ++i) back += (1 - pane_transmittance(std::sqrt((i + 0.5) / kSteps))) / kSteps;
    const double window = (1 - kTop) / 2;
    const double truth = kReflectance * flux * pane_transmittance(1) / (4 * kPiD) /
                         (1 - kReflectance * (1 - window * (1 - back)));
    std::vector<CalculationSurface> points;
    for (const V3d& place : {V3d(1, 0, 0), V3d(0, -0.8, -0.6), V3d(-0.6, 0, 0.8)}) {
        CalculationSurface point = plane(0, 1e-6, {1, 1});
        point.corner = 0.999 * place;
        point.normal = -place;
        point.u = 1e-6 * V3d(place.y, -place.x, 0).normalized();
        point.v = point.normal.cross(point.u);
        point.up = point.v.normalized();
        points.push_back(point);
    }
    Listener listener;
    IlluminanceOptions options;
    options.workers = {2};
    options.most_samples = 4;
    const IlluminanceReport report = illuminance_on(points, job_of(world), options, listener);
    EXPECT_EQ(listener.warnings, 0);
    for (const SurfaceIlluminance& surface : report.surfaces) {
        const Reading95& found = surface.points.front().all;
        // The window's rim and the light that it reflects unevenly are not in the closed form.
        EXPECT_NEAR(found.value, truth, 2 * found.half_width + 0.003 * truth);
        EXPECT_LT(found.half_width, 0.02 * truth);
    }
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
