#include "lights/measurement/plane_irradiance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "lights/measurement/acquire.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"

namespace lucerna {
namespace plane_irradiance_test {

using testing::all_rigs;
using testing::brute_h;
using testing::error_of;
using ::testing::HasSubstr;
using testing::ListeningMonitor;
using testing::random_field;
using testing::rig_a;
using testing::rig_b;
using testing::rig_c;

// Evaluates ∫ L cosθ cosθ' / r² over S by the midpoint rule, without cancelling any factors.
double brute_irradiance(const LightField& field, const V3d& point, int kSide,
                        const std::function<double(const V2d&, const V2d&)>& radiance) {
    const Rig& rig = field.rig();
    const V2d low(rig.interval_edge(0, 0), rig.interval_edge(1, 0));
    const V2d size = -2.0 * low;
    double sum = 0;
    for (int i = 0; i < kSide * kSide; ++i) {
        const V2d on_s(low.x + size.x * (i % kSide + 0.5) / kSide,
                       low.y + size.y * (static_cast<double>(i / kSide) + 0.5) / kSide);
        const V3d way = point - V3d(on_s.x, on_s.y, 0);
        const V2d on_m = on_s + V2d(way.x, way.y) * (rig.distance / way.z);
        const double r2 = way.length2(), cos2 = way.z * way.z / r2;
        sum += radiance(on_s, on_m) * cos2 / r2;
    }
    return sum * size.x * size.y / (kSide * kSide);
}

// Evaluates the irradiance with L = h / g.
double brute_irradiance(const LightField& field, const V3d& point) {
    return brute_irradiance(field, point, 900, [&](const V2d& on_s, const V2d& on_m) {
        return brute_h(field, on_s, on_m) / field.rig().geometric_term(on_s, on_m);
    });
}

TEST(PlaneIrradiance, ApproximateReconstruction_IsTheIntegralOfItsRadiance) {
    for (const Rig& rig : {rig_b(), rig_c(), testing::rig_d()}) {
        const LightField field = random_field(rig, -0.3F, 1.0F, 12);
        const testing::ApproximateRadiance radiance(field);
        for (const V3d& point : {V3d(0.003, -0.004, 0.02), V3d(0.004, 0.013, 0.08), V3d(0.05, -0.06, 0.3)}) {
            const double expected = brute_irradiance(field, point, 300, radiance);
            const double found = irradiance(field, point, Reconstruction::approximate);
            EXPECT_NEAR(found, expected, 1e-2 * std::fabs(expected)) << "at z = " << point.z;
            // The exact reconstruction differs visibly, so it cannot pass for the approximate one.
            EXPECT_GT(std::fabs(found / irradiance(field, point) - 1), 0.015) << "at z = " << point.z;
            ListeningMonitor monitor;
            const PlaneIrradiance plane = project(field, {point.z, {point.x, point.y}, {1e-3, 1e-3}, {3, 1}},
                                                  Workers{2}, monitor, Reconstruction::approximate);
            EXPECT_NEAR(plane.at(1, 0), found, 1e-12 * std::fabs(found));
        }
        // On S itself the irradiance is the radiance integrated over the solid angle of M; compares as close
        // to S as double precision allows.
        const double on_s = irradiance(field, {0.002, 0.003, 0}, Reconstruction::approximate);
        const double near = irradiance(field, {0.002, 0.003, 1e-7}, Reconstruction::approximate);
        EXPECT_NEAR(on_s, near, 1e-2 * std::fabs(near));
    }
}

TEST(PlaneIrradiance, Long_Point_RandomFieldsOfBothSetups_IsTheIntegralOfTheirRadiance) {
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_field(rig, -0.3F, 1.0F, 11);
        for (const V3d& point : {V3d(0.003, -0.004, 0.02), V3d(-0.01, 0.012, 0.05), V3d(0.004, 0.01, 0.08),
                                 V3d(0.05, -0.06, 0.3)}) {
            const double expected = brute_irradiance(field, point);
            ASSERT_NE(expected, 0);
            // The midpoint rule meets the pixels' edges somewhere within its steps.
            EXPECT_NEAR(irradiance(field, point), expected, 4e-3 * std::fabs(expected) + 1e-6)
                << "at z = " << point.z;
        }
    }
}

TEST(PlaneIrradiance, Flux_AtAnyDistance_IsTheFields) {
    ListeningMonitor monitor;
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_field(rig, -0.2F, 1.0F, 5);
        for (const double z : {0.0, 1e-6, 0.01, 0.08, 0.08 * (1 + 1e-14), 1.0}) {
            // The plane is wide enough for every ray: S and M lie within 0.2 m of the axis.
            const double side = 0.4 * (1 + z / rig.distance);
            const PlaneIrradiance plane =
                project(field, {z, {0.001, -0.002}, {side, side}, {601, 403}}, Workers{2}, monitor);
            // Only the midpoints of the pixels' samples err, at kinks and steps.
            EXPECT_NEAR(plane.flux(), field.flux(), 1e-2 * std::fabs(field.flux())) << "at z = " << z;
        }
    }
}

TEST(PlaneIrradiance, OneCoefficient_OnM_LightsItsPixelUpright) {
    Rig rig = rig_b();
    std::vector<float> e(rig.coefficients());
    e[rig.index(1, 0, 3, 4)] = 2;
    const LightField field(rig, std::move(e));
    const V2d lit(rig.column_edge(0, 1, 3) + 0.5 * rig.pixel.x, rig.column_edge(1, 1, 4) + 0.5 * rig.pixel.y);
    // All of the filter's light, E Δ_u Δ_v, falls on this pixel and none on its neighbours.
    EXPECT_NEAR(irradiance(field, {lit.x, lit.y, rig.distance}), 2 * rig.spacing.x * rig.spacing.y, 1e-12);
    EXPECT_EQ(irradiance(field, {-lit.x, lit.y, rig.distance}), 0);
    EXPECT_EQ(irradiance(field, {lit.x, -lit.y, rig.distance}), 0);
    // On S it is the bell over filter (1, 0).
    EXPECT_NEAR(irradiance(field, {rig.filter(0, 1), rig.filter(1, 0), 0}), 2 * rig.pixel.x * rig.pixel.y,
                1e-12);
}

TEST(PlaneIrradiance, LambertianDisc_OnTheAxis_IsTheClosedForm) {
    ListeningMonitor monitor;
    constexpr double kRadius = 0.01, kFlux = 3;
    Rig rig;
    rig.views = {25, 25};
    rig.spacing = V2d(2 * kRadius / 22);
    rig.pixels = {45, 45};  // ±45 mm: everything through which the points below see the disc
    rig.distance = 0.05;
    rig.pixel = V2d(0.002);
    const LightField field = acquire(cosine_emitter(EmitterModel::Outline::disc, V2d(kRadius), kFlux), rig,
                                     Workers{2}, monitor, {2, 1});
    for (const double z : {0.01, 0.03, 0.1, 0.5}) {
        // E = π L sin²θ, with L = Φ / (π A).
        const double sin2 = kRadius * kRadius / (kRadius * kRadius + z * z);
        const double expected = kFlux / (M_PI * kRadius * kRadius) * sin2;
        EXPECT_NEAR(irradiance(field, {0, 0, z}), expected, 0.01 * expected) << "at z = " << z;
    }
}

TEST(PlaneIrradiance, Rays_Counted_AgreeWithTheirNumber) {
    RaySet rays;
    rays.rays = {{{0, 0, 0}, {0, 0, 1}, 2.0F},        // lands in the middle
                 {{0, 0, 0}, {0.6F, 0, 0.8F}, 1.0F},  // 0.75 z to the right
                 {{0, 0, 0}, {0, 0, -1}, 5.0F},       // backward
                 {{-0.9F, 0, 2}, {0, 0, 1}, 3.0F},    // starts beyond the plane: its line counts
                 {{0, 0, 0}, {1, 0, 1e-30F}, 5.0F}};  // grazing
    const PlaneIrradiance plane = project(rays, {1, {0, 0}, {2, 1}, {4, 1}});
    EXPECT_EQ(plane.values, (std::vector<double>{6, 0, 4, 2}));  // 0.5 m² a pixel
    EXPECT_EQ(plane.flux(), 6);
}

TEST(PlaneIrradiance, Frame_AboutTheLight_HoldsNearlyAllOfIt) {
    ListeningMonitor monitor;
    const LightField field = random_field(rig_b(), 0.5F, 1.0F, 5);
    for (const double z : {0.0, 0.05, 1.0}) {
        const PlanePatch patch = frame_light(field, z, 64, Workers{2}, monitor);
        const double share = project(field, patch, Workers{2}, monitor).flux() / field.flux();
        EXPECT_GT(share, 0.9) << "at z = " << z;
        EXPECT_LT(share, 1.01) << "at z = " << z;
    }
}

TEST(PlaneIrradiance, BadPatches_AreRefused) {
    ListeningMonitor monitor;
    const LightField field = random_field(rig_b(), 0, 1, 5);
    const auto error = [&](const PlanePatch& patch) {
        return error_of([&] { project(field, patch, Workers{1}, monitor); });
    };
    EXPECT_THAT(error({-1, {0, 0}, {1, 1}, {4, 4}}), HasSubstr("in front of S"));
    EXPECT_THAT(error({1, {0, 0}, {0, 1}, {4, 4}}), HasSubstr("size"));
    EXPECT_THAT(error({1, {0, 0}, {1, 1}, {0, 4}}), HasSubstr("pixels"));
    EXPECT_THAT(error({NAN, {0, 0}, {1, 1}, {4, 4}}), HasSubstr("finite"));
}

}  // namespace plane_irradiance_test
}  // namespace lucerna
