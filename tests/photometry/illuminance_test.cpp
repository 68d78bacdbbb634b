// Compares illuminance on calculation surfaces with closed forms, each of which the stated interval must
// cover as often as it claims.
#include "engine/photometry/illuminance.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/pbrt/read_scene.h"
#include "tests/photometry/stated_intervals.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace illuminance_test {

constexpr double kL = 3;

using namespace lucerna::testing;

double under_disc(double d, double h, double r) {
    return testing::under_disc(kL, d, h, r);
}
// Returns the illuminance at depth h below the corner of a parallel rectangle a x b of radiance kL, with the
// sign of a b.
double under_corner(double a, double b, double h) {
    const double x = a / h, y = b / h;
    const double p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
    return kL / 2 * (x / p * std::atan(y / p) + y / q * std::atan(x / q));
}

constexpr const char* kDisc =
    "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAttributeBegin\n"
    "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Translate 0 0 2 Rotate 180 1 0 0\n"
    "Shape \"disk\" \"float radius\" 0.7\nAttributeEnd\n";
constexpr const char* kPoint = "LightSource \"point\" \"rgb I\" [3 3 3] \"point3 from\" [0.2 -0.1 1.5]\n";

TEST(Illuminance, UnderAPointADiscAndARectangle_IsTheClosedFormWithinItsIntervals) {
    const CalculationSurface surface = plane(0.5, 3, {20, 20});
    expect_as_stated(measure(kPoint, surface, 4).surfaces[0], [](const V3d& p) {
        const V3d way = V3d(0.2, -0.1, 1.5) - p;
        return kL * way.z / std::pow(way.length(), 3);
    });
    const SurfaceIlluminance under = measure(kDisc, surface, 4).surfaces[0];
    expect_as_stated(under, [](const V3d& p) { return under_disc(std::hypot(p.x, p.y), 1.5, 0.7); });
    const auto rectangle =
        "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Translate 0 0 2\n"
        "Shape \"bilinearmesh\" \"point3 P\" [-1 -0.4 0  -1 0.4 0  1 -0.4 0  1 0.4 0]\n";
    expect_as_stated(measure(rectangle, surface, 4).surfaces[0], [](const V3d& p) {
        double e = 0;
        for (const double x : {-1.0, 1.0})
            for (const double y : {-0.4, 0.4})
                e += (x > 0) == (y > 0) ? under_corner(x - p.x, y - p.y, 1.5)
                                        : -under_corner(x - p.x, y - p.y, 1.5);
        return e;
    });
    // The test must reject intervals half as wide, and a slightly larger disc.
    const Truth truth = [](const V3d& p) { return under_disc(std::hypot(p.x, p.y), 1.5, 0.7); };
    EXPECT_FALSE(as_stated(misses(under, truth, 0.5)));
    EXPECT_FALSE(
        as_stated(misses(under, [](const V3d& p) { return under_disc(std::hypot(p.x, p.y), 1.5, 0.71); })));
}

TEST(Illuminance, OfEveryKind_IsTheClosedFormOfAPoint) {
    const V3d lamp(0.2, -0.1, 1.5);
    const auto at = [&](ReceiverKind kind, const std::function<double(const V3d&)>& of_direction,
                        V3f normal) {
        CalculationSurface surface = plane(0.3, 3, {12, 12}, kind);
        surface.normal = normal;
        expect_as_stated(measure(kPoint, surface, 16).surfaces[0], [&](const V3d& p) {
            const V3d way = lamp - p;
            return kL / way.length2() * of_direction(way.normalized());
        });
    };
    const auto sine = [](const V3d& w) { return std::hypot(w.x, w.y); };
    at(ReceiverKind::planar, [](const V3d& w) { return std::max(0.0, w.x); }, {1, 0, 0});
    at(ReceiverKind::cylindrical, [&](const V3d& w) { return sine(w) / kPiD; }, {0, 0, 1});
    at(ReceiverKind::semicylindrical, [&](const V3d& w) { return (sine(w) + w.x) / kPiD; }, {1, 0, 0});
    at(ReceiverKind::hemispherical, [](const V3d& w) { return (1 + w.z) / 4; }, {0, 0, 1});
    at(ReceiverKind::spherical, [](const V3d&) { return 0.25; }, {0, 0, 1});
}

// A point lamp shines in a ball of absorbing fog. Each point's light is attenuated along its own way through
// the fog, wherever the camera is: outside, in the fog, or in a small ball of smoke far away.
TEST(Illuminance, InFog_IsThatOfTheReceiversOwnMedium) {
    constexpr double kSigma = 0.5, kBall = 1.6;
    const std::string media =
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.5 0.5 0.5] \"rgb "
        "sigma_s\" [0 0 0]\nMakeNamedMedium \"smoke\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [2 2 "
        "2] \"rgb sigma_s\" [0 0 0]\n";
    const std::string world =
        "AttributeBegin MediumInterface \"fog\" \"fog\"\n" + std::string(kPoint) +
        "AttributeEnd\nMaterial \"interface\"\n"
        "AttributeBegin MediumInterface \"fog\" \"\" Shape \"sphere\" \"float radius\" 1.6 AttributeEnd\n"
        "AttributeBegin MediumInterface \"smoke\" \"\" Translate 30 0 0\n"
        "Shape \"sphere\" \"float radius\" 0.05 AttributeEnd\n";
    // The points extend from the fog to beyond it.
    const CalculationSurface surface = plane(0.5, 3, {8, 8});
    const auto truth = [](const V3d& p) {
        const V3d lamp(0.2, -0.1, 1.5), way = lamp - p;
        const V3d w = way.normalized();
        // Computes the way from p to the ball, if p lies outside.
        const double along = w.dot(p), inside = sqr(along) - p.length2() + sqr(kBall);
        const double outside = p.length() > kBall ? std::max(0.0, -along - std::sqrt(inside)) : 0.0;
        return kL * way.z / std::pow(way.length(), 3) * std::exp(-kSigma * (way.length() - outside));
    };
    for (const char* camera : {"LookAt 0 0 -9 0 0 0 0 1 0 ", "MediumInterface \"\" \"fog\" ",
                               "LookAt 30 0 0 0 0 0 0 1 0 MediumInterface \"\" \"smoke\" "}) {
        SCOPED_TRACE(camera);
        Monitor silent;
        Job job = read_scene_text(
            media + camera + "Camera \"perspective\" Film \"rgb\" WorldBegin MediumInterface \"\" \"\"\n" +
                world,
            "scene.pbrt", {}, Workers{2}, silent);
        IlluminanceOptions options;
        options.workers = {2};
        options.most_samples = 16;
        const IlluminanceReport report =
            illuminance_on(std::vector{surface}, std::move(job), options, silent);
        expect_as_stated(report.surfaces[0], truth, 5e-5);
        EXPECT_FALSE(as_stated(misses(report.surfaces[0], [&](const V3d& p) {
            const V3d way = V3d(0.2, -0.1, 1.5) - p;
            return kL * way.z / std::pow(way.length(), 3);
        })));
    }
}

// A surface that reflects only its emission must leave no rounding error in the indirect part.
TEST(Illuminance, InABlackRoom_HasNoIndirectLight) {
    const IlluminanceReport report = measure(std::string(kDisc) + kPoint, plane(0.5, 3, {4, 4}), 16);
    for (const PointIlluminance& point : report.surfaces[0].points) EXPECT_EQ(point.indirect.value, 0);
}

// Under a uniform sky of radiance L planar, cylindrical and spherical sensors all read E = pi L.
TEST(Illuminance, UnderAnEvenSky_IsPiL) {
    const auto sky = "LightSource \"infinite\" \"rgb L\" [3 3 3]\n";
    for (const ReceiverKind kind :
         {ReceiverKind::planar, ReceiverKind::cylindrical, ReceiverKind::spherical}) {
        expect_as_stated(measure(sky, plane(0, 1, {4, 4}, kind), 4).surfaces[0],
                         [](const V3d&) { return kPiD * kL; });
    }
}

// In a sphere that emits L and reflects rho, E = pi L / (1 - rho), of which pi L is direct.
TEST(Illuminance, Long_InAGlowingSphere_IsASeriesOfReflections) {
    const std::string sphere =
        "Material \"diffuse\" \"rgb reflectance\" [0.6 0.6 0.6]\n"
        "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] ReverseOrientation\n"
        "Shape \"sphere\" \"float radius\" 2\n";
    // The medium lies outside, where nothing sees it; a medium anywhere makes paths use the volumetric
    // method.
    const std::string medium =
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [1 1 1]\n"
        "AttributeBegin Material \"interface\" MediumInterface \"fog\" \"\" Translate 0 0 9\n"
        "Shape \"sphere\" \"float radius\" 0.1 AttributeEnd\n";
    for (const std::string& world : {sphere, medium + sphere}) {
        const SurfaceIlluminance found = measure(world, plane(0.2, 1, {8, 8}), 64).surfaces[0];
        expect_as_stated(found, [](const V3d&) { return kPiD * kL / 0.4; });
        EXPECT_NEAR(found.direct, kPiD * kL, 0.02 * kPiD * kL);
        for (const PointIlluminance& point : found.points)
            EXPECT_NEAR(point.direct + point.indirect.value, point.all.value, 1e-4 * point.all.value);
    }
}

// The points lie exactly on a surface of the scene and must not fall below it by rounding, even far from the
// origin.
TEST(Illuminance, OnASurfaceOfTheScene_SeesWhatIsAbove) {
    for (const double far : {0.0, 1e4}) {
        const std::string away = fmt::format("Translate {0} {0} {0}\n", far);
        const std::string world = away + std::string(kDisc) +
                                  "Shape \"trianglemesh\" \"point3 P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0]\n"
                                  "\"integer indices\" [0 1 2  0 2 3]\n";
        CalculationSurface floor = plane(far, 3, {12, 12});
        floor.corner += V3d(far, far, 0);
        expect_as_stated(measure(world, floor, 16).surfaces[0], [far](const V3d& p) {
            return under_disc(std::hypot(p.x - far, p.y - far), 2, 0.7);
        });
    }
}

// Sensors of every kind stand on a floor. Those that face sideways or down must also lie above it.
TEST(Illuminance, OfEveryKindOnAFloor_IsThatOfFreeSpaceAbove) {
    const V3d lamp(0.2, -0.1, 1.5);
    const std::string world = std::string(kPoint) +
                              "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n"
                              "Shape \"bilinearmesh\" \"point3 P\" [-3 -3 0.3 3 -3 0.3 -3 3 0.3 3 3 0.3]\n";
    const auto at = [&](ReceiverKind kind, const std::function<double(const V3d&)>& of_direction,
                        V3f normal) {
        SCOPED_TRACE(receiver_kind_name(kind));
        CalculationSurface surface = plane(0.3, 2, {8, 8}, kind);
        surface.normal = normal;
        expect_as_stated(
            measure(world, surface, 16).surfaces[0],
            [&](const V3d& p) {
                const V3d way = lamp - p;
                return kL / way.length2() * of_direction(way.normalized());
            },
            5e-5);
    };
    const auto sine = [](const V3d& w) { return std::hypot(w.x, w.y); };
    at(ReceiverKind::planar, [](const V3d& w) { return std::max(0.0, w.x); }, {1, 0, 0});
    at(ReceiverKind::cylindrical, [&](const V3d& w) { return sine(w) / kPiD; }, {0, 0, 1});
    at(ReceiverKind::semicylindrical, [&](const V3d& w) { return (sine(w) + w.x) / kPiD; }, {1, 0, 0});
    at(ReceiverKind::hemispherical, [](const V3d& w) { return (1 + w.z) / 4; }, {0, 0, 1});
    at(ReceiverKind::spherical, [](const V3d&) { return 0.25; }, {0, 0, 1});
}

// A floor of a few metres lies on a ground of kilometres. With the ground's error bound rays would start
// centimetres up.
TEST(Illuminance, OnAFloorInAWideLandscape_IsAsExactAsOfTheFloorAlone) {
    const std::string floor =
        "Shape \"bilinearmesh\" \"point3 P\" [-1 -1 0  1 -1 0  -1 1 0  1 1 0]\n"
        "Shape \"bilinearmesh\" \"point3 P\" [-9000 -9000 -1  9000 -9000 -1  -9000 9000 -1  9000 9000 -1]\n";
    const std::string near_disc =
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAttributeBegin\n"
        "AreaLightSource \"diffuse\" \"rgb L\" [3 3 3] Translate 0 0 0.2 Rotate 180 1 0 0\n"
        "Shape \"disk\" \"float radius\" 0.1\nAttributeEnd\n";
    const IlluminanceReport report = measure(near_disc + floor, plane(0, 0.5, {6, 6}), 64);
    expect_as_stated(report.surfaces[0],
                     [](const V3d& p) { return under_disc(std::hypot(p.x, p.y), 0.2, 0.1); });
    // The comparison above requires this precision: a rise of a centimetre increases the mean by a tenth.
    EXPECT_LT(report.surfaces[0].mean.half_width, 0.02 * report.surfaces[0].mean.value);
}

std::vector<LuminairePlace> luminaires_in(const std::string& world) {
    Monitor silent;
    const Job job = read_scene_text(
        "Option \"string unit\" \"photometric\" Camera \"perspective\" Film \"rgb\" "
        "WorldBegin\n" +
            world,
        "scene.pbrt", {}, Workers{2}, silent);
    return luminaires_of(job.scene);
}

// One mesh of a panel of 1 m x 1 m, and one of 3 m x 1 m that is joined of three.
TEST(Luminaires, OfAMesh_AreItsPiecesThatDoNotTouch) {
    const auto found = luminaires_in(
        "AreaLightSource \"diffuse\" \"rgb L\" [100 100 100]\nShape \"trianglemesh\" \"point3 P\" [0 0 3 1 0 "
        "3 0 1 3 "
        "1 1 3  5 0 3 6 0 3 5 1 3 6 1 3  7 0 3 7 1 3  8 0 3 8 1 3] \"integer indices\" [0 1 2 1 3 2  4 5 6 5 "
        "7 6  5 8 7 8 "
        "9 7  8 10 9 10 11 9]\n");
    ASSERT_EQ(found.size(), 2U);
    const LuminairePlace &small = found[found[0].size.x > 2], &large = found[found[0].size.x < 2];
    EXPECT_NEAR((small.place - V3d(0.5, 0.5, 3)).length(), 0, 1e-5);
    EXPECT_NEAR((large.place - V3d(6.5, 0.5, 3)).length(), 0, 1e-5);
    EXPECT_NEAR(large.size.x, 3, 1e-5);
    EXPECT_NEAR(small.flux, kPiD * 100, 1e-3);
    EXPECT_NEAR(large.flux, 3 * kPiD * 100, 3e-3);
}

TEST(Luminaires, OfAClosedMesh_IsOne) {
    EXPECT_EQ(
        luminaires_in(
            "AreaLightSource \"diffuse\" \"rgb L\" [100 100 100]\nShape \"trianglemesh\" \"point3 P\" "
            "[0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1] \"integer indices\" [0 2 1 0 3 2 4 5 6 4 6 "
            "7 0 1 5 0 5 4 2 3 7 2 7 6 1 2 6 1 6 5 0 4 7 0 7 3]\n")
            .size(),
        1U);
}

TEST(Luminaires, OfAPhotometricFile_AimAtTheFirstSurfaceBeyond) {
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "lamp.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0.6 0.6 0\n1 1 25\n0 90 180\n0\n"
           "900 300 100\n";
    const auto found =
        luminaires_in(fmt::format("Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0 9 -9 0 -9 9 0 9 9 "
                                  "0]\nLightSource \"photometric\" \"string "
                                  "filename\" \"{}\" \"point3 from\" [1 2 4] \"point3 to\" [3 2 2]\n",
                                  (folder / "lamp.ies").string()));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_NEAR((found[0].axis - V3d(1, 0, -1).normalized()).length(), 0, 1e-6);
    ASSERT_TRUE(found[0].aim);
    EXPECT_NEAR((*found[0].aim - V3d(5, 2, 0)).length(), 0, 1e-4);
}

TEST(Illuminance, GroupsAddUp) {
    const auto two =
        "LightSource \"point\" \"rgb I\" [3 3 3] \"point3 from\" [0 0 2] \"string lightgroup\" \"a\"\n"
        "LightSource \"point\" \"rgb I\" [1 1 1] \"point3 from\" [1 0 2] \"string lightgroup\" \"b\"\n";
    const IlluminanceReport report = measure(two, plane(0, 2, {6, 6}), 64);
    ASSERT_EQ(report.groups, (std::vector<std::string>{"a", "b"}));
    const SurfaceIlluminance& found = report.surfaces[0];
    for (const PointIlluminance& point : found.points)
        EXPECT_NEAR(point.groups[0] + point.groups[1], point.all.value, 1e-4);
    expect_as_stated(found, [](const V3d& p) {
        const V3d a = V3d(0, 0, 2) - p, b = V3d(1, 0, 2) - p;
        return 6 / std::pow(a.length(), 3) + 2 / std::pow(b.length(), 3);
    });
}

TEST(Illuminance, Statistics_AreThoseOfThePoints) {
    const SurfaceIlluminance found = measure(kDisc, plane(0.5, 3, {7, 5}), 4).surfaces[0];
    double sum = 0, least = INFINITY, greatest = 0;
    for (const PointIlluminance& point : found.points) {
        sum += point.all.value;
        least = std::min(least, point.all.value);
        greatest = std::max(greatest, point.all.value);
    }
    EXPECT_NEAR(found.mean.value, sum / 35, 1e-9);
    EXPECT_EQ(found.least.value, least);
    EXPECT_EQ(found.greatest.value, greatest);
    EXPECT_NEAR(found.uniformity.value, least / (sum / 35), 1e-12);
}

TEST(Illuminance, Long_ToAPrecision_IsThatPreciseAndNoMore) {
    Monitor silent;
    IlluminanceOptions options;
    options.workers = {2};
    for (const double precision : {0.002, 0.0006}) {
        options.precision = precision;
        const IlluminanceReport report = illuminance_on(
            std::vector{plane(0.5, 3, {8, 8})},
            job_of(std::string(kDisc) + "Material \"diffuse\"\nShape \"sphere\" \"float radius\" 0.2\n"),
            options, silent);
        EXPECT_EQ(report.ended_by, "precision");
        EXPECT_LE(report.precision, precision);
        EXPECT_GT(report.precision, precision / 4);
    }
}

TEST(Illuminance, IsTheSameForAnyNumberOfThreads) {
    const IlluminanceReport one = measure(kDisc, plane(0.5, 3, {5, 5}), 8, 1),
                            two = measure(kDisc, plane(0.5, 3, {5, 5}), 8, 2);
    for (std::size_t i = 0; i < 25; ++i) {
        EXPECT_EQ(one.surfaces[0].points[i].all.value, two.surfaces[0].points[i].all.value);
        EXPECT_EQ(one.surfaces[0].points[i].all.half_width, two.surfaces[0].points[i].all.half_width);
    }
}

TEST(Illuminance, StudentsQuantile_IsBoosts) {
    for (const int n : {2, 16, 17, 100, 100000})
        EXPECT_NEAR(student_95(n), quantile(complement(boost::math::students_t(n - 1), 0.025)), 1e-4) << n;
}

TEST(CalculationSurface, PointsLieAsTheStandardHasThem) {
    EXPECT_EQ(default_points(1, 1), V2i(5, 5));
    EXPECT_EQ(default_points(2, 2), V2i(6, 6));
    EXPECT_EQ(default_points(5, 5), V2i(8, 8));
    EXPECT_EQ(default_points(10, 10), V2i(10, 10));
    EXPECT_EQ(default_points(100, 100), V2i(20, 20));
    EXPECT_EQ(default_points(10, 1).y, 5);  // by the shorter side
}

}  // namespace illuminance_test
}  // namespace lucerna
