#include "lights/measurement/plane_irradiance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "engine/base/warp.h"
#include "lights/measurement/acquire.h"
#include "lights/measurement/ray_projection.h"
#include "lights/photometric_files.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/error_of.h"
#include "tests/support/shared_data.h"

namespace lucerna {
namespace far_field_test {

using testing::all_rigs;
using testing::error_of;
using ::testing::HasSubstr;
using testing::random_field;
using testing::rig_a;
using testing::rig_b;
using testing::rig_c;

// Evaluates D²/cos³ ∫∫ h by midpoints.
double brute_intensity(const LightField& field, const V2d& slope) {
    constexpr int kSteps = 600;
    const Rig& rig = field.rig();
    const V2d size = -2.0 * V2d(rig.interval_edge(0, 0), rig.interval_edge(1, 0));
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
            const V2d s(((i + 0.5) / kSteps - 0.5) * size.x, ((j + 0.5) / kSteps - 0.5) * size.y);
            sum += testing::brute_h(field, s, s + slope * rig.distance);
        }
    }
    const double cosine = 1 / std::sqrt(1 + slope.length2());
    return sqr(rig.distance) / (cosine * cosine * cosine) * sum * size.x * size.y / (kSteps * kSteps);
}

TEST(FarField, Intensity_IsTheIntegralOfTheFluxDensity) {
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_field(rig, -0.2F, 1, 9);
        const double typical = brute_intensity(field, {0, 0});
        for (const V2d& slope : {V2d(0, 0), V2d(0.05, -0.11), V2d(-0.31, 0.2), V2d(0.02, 0.3)})
            EXPECT_NEAR(far_intensity(field, slope), brute_intensity(field, slope), 4e-3 * typical);
        EXPECT_EQ(far_intensity(field, {9, 0}), 0) << "beside M";
    }
}

Rig disc_rig() {
    Rig rig;
    rig.views = {13, 13};
    rig.spacing = {0.002, 0.002};
    rig.pixels = {96, 96};
    rig.pixel = {0.002, 0.002};
    rig.distance = 0.04;
    return rig;
}

// A small disc lies on a wide plane S: the opening has the disc's area, not that of S. The field's basis
// blurs the disc's edge by one spacing of S, which is 1/9 of the radius.
TEST(FarField, Opening_IsThePartOfThePlaneThatShines) {
    Monitor silent;
    constexpr double kRadius = 0.009, kArea = M_PI * kRadius * kRadius;
    Rig rig = disc_rig();
    rig.views = {41, 31};
    rig.spacing = {0.001, 0.001};
    rig.pixels = {24, 24};
    rig.pixel = {0.008, 0.008};
    const LightField field = testing::lambertian_disc(rig, kRadius);
    const LuminousOpening opening = far_field(field, {5, 30}, Workers{2}, silent).info().opening;
    EXPECT_EQ(opening.name(), "rectangle");
    EXPECT_NEAR(opening.size.x * opening.size.y / kArea, 1, 0.06);
    EXPECT_NEAR(opening.size.x / opening.size.y, 1, 0.02);
    const LuminousOpening again = far_field(field, {5, 30}, Workers{1}, silent).info().opening;
    EXPECT_EQ(again.size, opening.size) << "on any number of threads";
}

// Rays of a Lambertian disc of 50 mm, as a field with far more coefficients than rays. Where `split`, the
// half at x > 0 shines towards +x only and the other one towards -x only.
LightField field_of_disc(int rays, bool split) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    Sampler s(5, Purpose::test, 0, 0);
    for (int i = 0; i < rays; ++i) {
        const V2f at = square_to_disc(s.next2());
        V3f d = square_to_cosine_hemisphere(s.next2());
        if (split) d.x = std::copysign(d.x, at.x);
        set.rays.push_back({V3f(0.025F * at.x, 0.025F * at.y, 0), d, 1.0F});
    }
    set.flux = rays;
    Rig rig;
    rig.views = {50, 50};
    rig.spacing = V2d(0.00104);
    rig.pixels = {21, 21};
    rig.pixel = V2d(0.04);
    rig.distance = 0.2;
    Monitor silent;
    return project_rays(set, rig, Workers{2}, silent).field;
}

// The noise of few rays does not make the luminous part smaller.
TEST(FarField, Opening_OfFewRays_IsThatOfTheLamp) {
    Monitor silent;
    constexpr double kArea = M_PI * sqr(0.025);
    for (const auto& [rays, tolerance] : {std::pair{50'000, 0.15}, {200'000, 0.05}}) {
        const LuminousOpening opening =
            far_field(field_of_disc(rays, false), {5, 30}, Workers{2}, silent).info().opening;
        EXPECT_NEAR(opening.size.x * opening.size.y / kArea, 1, tolerance) << rays;
        EXPECT_NEAR(opening.size.x / opening.size.y, 1, 0.03) << rays;
    }
}

// Half of the disc is luminous from every direction, though all of it shines.
TEST(FarField, Opening_OfALampInTwoParts_IsTheSizeOfOne) {
    Monitor silent;
    constexpr double kArea = M_PI * sqr(0.025);
    const LuminousOpening opening =
        far_field(field_of_disc(200'000, true), {5, 30}, Workers{2}, silent).info().opening;
    EXPECT_NEAR(opening.size.x * opening.size.y / kArea, 0.5, 0.06);
}

// A Lambertian disc of radiance 1 has I = A cos θ.
TEST(FarField, LambertianDisc_FallsWithTheCosine) {
    Monitor silent;
    constexpr double kRadius = 0.009, kArea = M_PI * kRadius * kRadius;
    const LightField field = testing::lambertian_disc(disc_rig(), kRadius);
    const PhotometricWeb web = far_field(field, {2.5, 15}, Workers{2}, silent);
    for (const double gamma : {0.0, 10.0, 20.0, 35.0, 50.0, 60.0}) {
        for (const double c : {0.0, 45.0, 135.0, 270.0}) {
            EXPECT_NEAR(web.intensity(web.direction(gamma, c)) / kArea, std::cos(gamma * M_PI / 180), 0.01)
                << gamma << ", " << c;
        }
        const double slope = std::tan(gamma * M_PI / 180);
        EXPECT_NEAR(far_intensity(field, {0, slope}) / kArea, std::cos(gamma * M_PI / 180), 0.02);
    }
}

TEST(FarField, WideLampInCoarsePixels_HasNoTeeth) {
    Monitor silent;
    constexpr double kRadius = 0.009;
    Rig rig = disc_rig();
    rig.pixels = {22, 22};
    rig.pixel = V2d(0.3 * rig.distance);  // 17° each in the middle
    const LightField field =
        acquire(cosine_emitter(EmitterModel::Outline::disc, V2d(kRadius), 1), rig, {}, silent);
    const PhotometricWeb web = far_field(field, {2.5, 15}, {}, silent);
    const double middle = web.intensity(V3d(0, 0, 1));
    double worst = 0, worst_tooth = 0;
    for (double theta = 2.5; theta < 60; theta += 2.5) {
        const double slope = std::tan(theta * M_PI / 180), cos_theta = std::cos(theta * M_PI / 180);
        worst =
            std::max(worst, std::fabs(web.intensity(V3d(slope, 0, 1).normalized()) / middle / cos_theta - 1));
        worst_tooth = std::max(
            worst_tooth,
            std::fabs(far_intensity(field, {slope, 0}) / far_intensity(field, {0, 0}) / cos_theta - 1));
    }
    EXPECT_LT(worst, 0.04);
    EXPECT_GT(worst_tooth, 0.08) << "the flux density itself has teeth, or this test has none";
}

TEST(FarField, OfAField_HasItsFluxToTheLastDigit) {
    Monitor silent;
    for (const Rig& rig : all_rigs()) {
        const LightField field = random_field(rig, 0, 1, 21);
        for (const FarFieldGrid steps : {FarFieldGrid{5, 15}, FarFieldGrid{1, 10}}) {
            const PhotometricWeb web = far_field(field, steps, Workers{2}, silent);
            EXPECT_NEAR(web.flux() / field.flux(), 1, 1e-5);
        }
    }
}

TEST(FarField, Threads_DoNotMatter) {
    Monitor silent;
    const LightField field = random_field(rig_a(), 0, 1, 22);
    EXPECT_EQ(far_field(field, {5, 15}, Workers{1}, silent).grid().candela,
              far_field(field, {5, 15}, Workers{3}, silent).grid().candela);
}

TEST(FarField, FromAfar_LightsAsTheFieldDoes) {
    Monitor silent;
    // The field is asymmetric, so that flips and rotations are detected.
    const LightField field = random_field(disc_rig(), 0, 1, 3);
    const PhotometricWeb web = far_field(field, {0.5, 2}, Workers{2}, silent);
    constexpr double kFar = 40;  // m, some 1500 times the lamp's size
    for (const V2d& slope : {V2d(0.2, 0.1), V2d(-0.5, 0.4), V2d(0.1, -0.9)}) {
        const V3d way = V3d(slope.x, slope.y, 1) * kFar;
        const V3d w = way.normalized();
        // The web is a mean over half a degree of noisy pixels.
        double near = 0;
        int count = 0;
        for (int i = -5; i <= 5; ++i) {
            for (int j = -5; j <= 5; ++j, ++count)
                near += irradiance(field, way + V3d(i * 0.03, j * 0.03, 0));
        }
        EXPECT_NEAR(near / count / (web.intensity(w) * w.z / way.length2()), 1, 0.05) << slope;
    }
}

TEST(FarField, OfRays_HoldsTheirFluxWhereverTheyGo) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    Sampler s(2, Purpose::test, 0, 0);
    for (int i = 0; i < 50'000; ++i) set.rays.push_back({V3f(0.0F), square_to_sphere(s.next2()), 0.001F});
    set.flux = 50;
    const PhotometricWeb web = far_field(set, {10, 30});
    EXPECT_NEAR(web.flux(), 50, 1e-4);
    EXPECT_EQ(web.grid().polar.back(), 180) << "half of them go back";
    // 50 lm spread evenly are 3.98 cd; the hat function at the pole holds some 380 rays.
    for (const double gamma : {0.0, 40.0, 90.0, 180.0})
        EXPECT_NEAR(web.intensity(web.direction(gamma, 60)), 50 / (4 * M_PI), 0.8);
}

// Rays of lamps whose intensity is known: smooth ones, and a beam of 3 degrees. Counted over the grid's steps
// alone, the peak of few rays would be chance.
TEST(FarField, OfFewRays_IsSmoothedOverCapsThatHoldEnough) {
    struct Known {
        double exponent;  // of the cosine
        int rays;
        // Tolerances are relative. A peak that is a tenth too high cuts 6 degrees off a Lambertian's beam.
        double most_smoothed, of_peak, of_angle;
    };
    const double narrow = std::log(0.5) / std::log(std::cos(1.5 * M_PI / 180));
    for (const Known& lamp :
         {Known{1, 10'000, 10, 0.15, 0.1}, Known{1, 100'000, 5, 0.12, 0.1}, Known{10, 10'000, 5, 0.15, 0.05},
          Known{narrow, 10'000, 1, 0.12, 0.15}, Known{narrow, 100'000, 0.2, 0.12, 0.05}}) {
        RaySet set;
        set.unit = FluxUnit::lumen;
        set.flux = 1;
        Sampler s(3, Purpose::test, 0, 0);
        for (int i = 0; i < lamp.rays; ++i) {
            const V2f u = s.next2();
            const double z = std::pow(1 - double{u.x}, 1 / (lamp.exponent + 1)), r = std::sqrt(1 - z * z),
                         phi = 2 * M_PI * double{u.y};
            set.rays.push_back({V3f(0.0F), V3f(V3d(r * std::cos(phi), r * std::sin(phi), z)),
                                1.0F / static_cast<float>(lamp.rays)});
        }
        const FarFieldGrid grid{lamp.exponent > 100 ? 0.1 : 1, 5};
        const PhotometricWeb web = far_field(set, grid);
        EXPECT_NEAR(web.flux(), 1, 1e-5);
        EXPECT_LE(web.info().smoothed, lamp.most_smoothed) << lamp.exponent;
        EXPECT_NE(ies_text(web, "rays").find("; means over caps of "), std::string::npos);
        const double peak = (lamp.exponent + 1) / (2 * M_PI);
        const double half = 2 * std::acos(std::pow(0.5, 1 / lamp.exponent)) * 180 / M_PI;
        const Beam beam = beam_of(web);
        EXPECT_NEAR(beam.peak, peak, lamp.of_peak * peak) << lamp.exponent << ' ' << lamp.rays;
        for (const double angle : beam.beam_angle)
            EXPECT_NEAR(angle, half, lamp.of_angle * half) << lamp.exponent << ' ' << lamp.rays;
    }
}

TEST(FarField, Ray_LandsInItsPlane) {
    RaySet set;
    set.rays.push_back({V3f(0.0F), V3f(0, -1, 1).normalized(), 2.0F});
    set.flux = 2;
    const PhotometricWeb web = far_field(set, {15, 30});
    EXPECT_GT(web.intensity(web.direction(45, 90)), 0) << "C90 holds -y";
    EXPECT_EQ(web.intensity(web.direction(45, 270)), 0);
    EXPECT_EQ(web.grid().polar.back(), 90);
}

TEST(FarField, MeasuredLed_KeepsItsFluxAsAPhotometricFile) {
    LUCERNA_NEED_DATA(file, "osram-ostar-green-100k.tm25ray");
    Monitor silent;
    const PhotometricWeb web = far_field(read_rays(file, silent), {2.5, 15});
    EXPECT_NEAR(web.flux(), 337, 0.01);
    const PhotometricWeb again = parse_ies(ies_text(web, "LED"), "led.ies", silent);
    EXPECT_NEAR(again.flux() / web.flux(), 1, 1e-5);
    // A bare LED chip is approximately Lambertian.
    EXPECT_NEAR(web.intensity({0, 0, 1}) / (337 / M_PI), 1, 0.1);
}

TEST(FarField, WhatCannotBe_IsRefused) {
    Monitor silent;
    const LightField field = random_field(rig_a(), 0, 1, 1), dark = random_field(rig_a(), -1, 0, 1);
    EXPECT_THAT(error_of([&] {
                    far_field(field, {7, 15}, Workers{1}, silent);
                }),
                HasSubstr("step of 7 degrees"));
    EXPECT_THAT(error_of([&] { far_field(field, {5, 0.001}, Workers{1}, silent); }), HasSubstr("0.05"));
    EXPECT_THAT(error_of([&] {
                    far_field(dark, {5, 15}, Workers{1}, silent);
                }),
                HasSubstr("a positive flux"));
    EXPECT_THAT(error_of([&] { far_field(RaySet{}, {5, 15}); }), HasSubstr("no flux"));
}

}  // namespace far_field_test
}  // namespace lucerna
