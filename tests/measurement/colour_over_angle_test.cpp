// Colour over the angle, against emitters whose colour at every angle is a formula.
#include "lights/measurement/colour_over_angle.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/spectrum.h"
#include "lights/measurement/acquire.h"

namespace lucerna {
namespace colour_over_angle_test {

using ::testing::HasSubstr;

const Rgb kMiddle(1.0F), kGrazing = Rgb(1.6F, 0.95F, 0.1F) / luminance(Rgb(1.6F, 0.95F, 0.1F));

// Returns a Lambertian disc that is white ahead and yellow to the sides: the mixture varies as 1 - cos θ.
EmitterModel yellowing_disc() {
    EmitterModel emitter = cosine_emitter(EmitterModel::Outline::disc, {0.004, 0}, 5, 1);
    set_colours(emitter, {kMiddle, std::nullopt, kGrazing});
    return emitter;
}
V3d colour_at(double degrees) {
    const double t = 1 - std::cos(degrees * M_PI / 180);
    return (1 - t) * rgb_to_xyz(kMiddle) + t * rgb_to_xyz(kGrazing);
}

Rig wide_rig() {
    Rig rig;
    rig.views = {7, 7};
    rig.spacing = {0.002, 0.002};
    rig.pixels = {60, 60};
    rig.pixel = {0.004, 0.004};
    rig.distance = 0.04;
    return rig;
}

V3d swapped(const V3d& xyz) {
    return {xyz.z, xyz.y, xyz.x};
}

TEST(ColourOverAngle, OfAField_IsTheFormulas) {
    Monitor silent;
    const LightField field = acquire(yellowing_disc(), wide_rig(), {2}, silent, {2, 2});
    ASSERT_TRUE(field.coloured());
    const AngularColours colours = colours_over_angle(field, {5, 30}, {2}, silent);
    for (std::size_t i = 0; i < colours.polar.size() && colours.polar[i] <= 60; i += 2) {
        const V3d expected = colour_at(colours.polar[i]);
        EXPECT_LT(delta_uv(colours.over_planes(i), expected), 1e-3) << colours.polar[i];
        if (colours.polar[i] > 45) {
            EXPECT_GT(delta_uv(swapped(colours.over_planes(i)), expected), 0.02) << "X and Z swapped";
        }
        EXPECT_NEAR(delta_uv(colours.over_planes(i), colours.on_axis()), delta_uv(expected, colour_at(0)),
                    1e-3);
    }
    // The mean is that of the field's light, and only the sides deviate from it visibly.
    EXPECT_LT(delta_uv(colours.mean, field.xyz()), 1e-4);
    EXPECT_GT(colours.largest_delta(0.1), colours.largest_delta(0.9));
}

TEST(ColourOverAngle, OfRays_IsTheFormulas) {
    RaySet set;
    V3d sum(0, 0, 0);
    for (int i = 0; i < 400'000; ++i) {
        Sampler sampler(4, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V3f d = square_to_cosine_hemisphere(sampler.next2());
        set.rays.push_back({V3f(0.0F), d, 1});
        set.tristimulus.push_back(V3f(colour_at(std::acos(double{d.z}) * 180 / M_PI)));
        sum += V3d(set.tristimulus.back());
    }
    set.unit = FluxUnit::lumen;
    set.flux = 400'000;
    set.xyz = sum / sum.y;
    const AngularColours colours = colours_over_angle(set, {10, 90});
    // The cosine-weighted mean of cos θ over the hemisphere is 2/3.
    const V3d mean = 2.0 / 3.0 * rgb_to_xyz(kMiddle) + 1.0 / 3.0 * rgb_to_xyz(kGrazing);
    EXPECT_LT(delta_uv(colours.mean, mean), 5e-4);
    for (std::size_t i = 1; i < 7; ++i)
        EXPECT_LT(delta_uv(colours.over_planes(i), colour_at(colours.polar[i])), 2e-3) << colours.polar[i];
    EXPECT_GT(delta_uv(colours.over_planes(6), colour_at(0)), 0.02) << "what this test is to refuse";
}

// A beam of 4 degrees has one colour everywhere, but nine of ten rays are yellow and the tenth is blue. If
// the few blue rays were averaged over wider caps than the others, the beam's edge would be blue.
TEST(ColourOverAngle, OfFewRaysOfOneColour_HasNoColouredEdge) {
    constexpr double kBeam = 4 * M_PI / 180;
    const V3f yellow(0.9F, 1, 0), blue(1.5F, 0.5F, 8);
    RaySet set;
    V3d sum(0, 0, 0);
    double light = 0;
    for (int i = 0; i < 20'000; ++i) {
        Sampler sampler(6, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        const double cosine = 1 - double{u.x} * (1 - std::cos(kBeam)), sine = std::sqrt(1 - cosine * cosine),
                     phi = 2 * M_PI * double{u.y};
        set.rays.push_back({V3f(0.0F), V3f(V3d(sine * std::cos(phi), sine * std::sin(phi), cosine)), 1});
        set.tristimulus.push_back(i % 10 == 0 ? blue : yellow);
        sum += V3d(set.tristimulus.back());
        light += set.light_of(static_cast<std::size_t>(i));
    }
    set.unit = FluxUnit::lumen;
    set.flux = light;
    set.xyz = sum / sum.y;
    const AngularColours colours = colours_over_angle(set, {0.5, 30});
    int compared = 0;
    for (std::size_t i = 0; i < colours.polar.size(); ++i) {
        const V3d at = colours.over_planes(i);
        if (!(at.y > 0.02 * colours.peak())) continue;
        EXPECT_LT(delta_uv(at, colours.mean), 0.01) << colours.polar[i];
        ++compared;
    }
    EXPECT_GT(compared, 9) << "the beam's edge was compared";
    // Caps of the blue rays alone are wider.
    EXPECT_GT(smoothing_cap(set.channel(2), {0.5, 30}), smoothing_cap(set, {0.5, 30}));
}

TEST(ColourOverAngle, Table_HasARowForEachDirection) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    for (int i = 0; i < 1000; ++i) {
        Sampler sampler(5, Purpose::test, 0, static_cast<std::uint64_t>(i));
        set.rays.push_back({V3f(0.0F), square_to_cosine_hemisphere(sampler.next2()), 1});
    }
    set.flux = 1000;
    set.xyz = rgb_to_xyz(Rgb(1.0F));
    const std::string csv = colours_csv(colours_over_angle(set, {15, 90}), "lamp", "cd");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 3 + 7 * 4);
    EXPECT_THAT(csv, HasSubstr("\n0,0,"));
    // The chromaticity on and off the axis is that of D65.
    EXPECT_THAT(csv, HasSubstr(",0.31273,0.32903,0.19784,0.46834,0.00000,0.00000,650"));
}

}  // namespace colour_over_angle_test
}  // namespace lucerna
