// Rays of several colours as a light field in colour: near and far, against what is known of the lamp.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <vector>

#include "engine/base/chromaticity.h"
#include "engine/base/sampler.h"
#include "engine/base/spectrum.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"

namespace lucerna {
namespace coloured_rays_test {

// A white LED by formula, in lumens: a blue square of half side 0.5 mm whose intensity goes by cos², and
// about it a yellow ring up to 1.5 mm that is Lambertian.
constexpr double kBlueFlux = 3, kYellowFlux = 97, kSide = 0.5e-3, kRing = 1.5e-3;
const V3d kBlue(0.16 / 0.03, 1, 0.81 / 0.03), kYellow(0.44 / 0.54, 1, 0.02 / 0.54);  // XYZ, Y = 1

RaySet white_led(int count, std::uint64_t seed) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = kBlueFlux + kYellowFlux;
    set.xyz = (kBlueFlux * kBlue + kYellowFlux * kYellow) / set.flux;
    // A fourth of the rays are blue, of less flux each.
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const bool blue = i % 4 == 0;
        V2d at;
        do {
            const V2f u = sampler.next2();
            at = (blue ? kSide : kRing) * V2d(2 * double{u.x} - 1, 2 * double{u.y} - 1);
        } while (!blue && (at.length() > kRing || std::max(std::fabs(at.x), std::fabs(at.y)) < kSide));
        const V2f u = sampler.next2();
        const double z = std::pow(1 - double{u.x}, 1.0 / (blue ? 3 : 2)), r = std::sqrt(1 - z * z);
        const double turn = 2 * M_PI * double{u.y};
        const V3d d(r * std::cos(turn), r * std::sin(turn), z);
        set.rays.push_back(
            {V3f(V3d(at.x, at.y, 0)), V3f(d),
             static_cast<float>(blue ? kBlueFlux / (count / 4) : kYellowFlux / (count - count / 4))});
        set.tristimulus.push_back(V3f(blue ? kBlue : kYellow));
    }
    return set;
}

double off_in_colour(const V3d& a, const V3d& b) {
    const Chromaticity p = chromaticity(a), q = chromaticity(b);
    return std::hypot(p.u - q.u, p.v - q.v);
}

// In rings of ten degrees about the axis: the rays counted, and the field's intensity over each.
TEST(ColouredRays, ColourOverAngle_IsThatOfTheRaysBinned) {
    Monitor silent;
    const RaySet set = white_led(200000, 1);
    const Projection p = fit_light_field(set, {}, {}, silent);
    ASSERT_TRUE(p.field.coloured());
    constexpr int kRings = 8;
    std::vector<V3d> counted(kRings, V3d(0));
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const double theta = std::acos(double{set.rays[i].d.z}) * 180 / M_PI;
        if (theta < 10 * kRings)
            counted[static_cast<std::size_t>(theta / 10)] +=
                double{set.rays[i].flux} * V3d(set.tristimulus[i]);
    }
    double worst_of_one_colour = 0;
    const LightField channels[3] = {p.field.channel(0), p.field.channel(1), p.field.channel(2)};
    for (int ring = 0; ring < kRings; ++ring) {
        V3d found(0);
        constexpr int kSteps = 6, kTurns = 12;
        for (int step = 0; step < kSteps; ++step) {
            const double theta = (ring + (step + 0.5) / kSteps) * 10 * M_PI / 180;
            for (int turn = 0; turn < kTurns; ++turn) {
                const double phi = (turn + 0.5) * 2 * M_PI / kTurns;
                const V2d slope = std::tan(theta) * V2d(std::cos(phi), std::sin(phi));
                for (int c = 0; c < 3; ++c) found[c] += std::sin(theta) * far_intensity(channels[c], slope);
            }
        }
        const double off = off_in_colour(found, counted[static_cast<std::size_t>(ring)]);
        const double of_one_colour = off_in_colour(set.xyz, counted[static_cast<std::size_t>(ring)]);
        std::cout << 10 * ring << " to " << 10 * ring + 10 << " degrees: du'v' " << off << ", of one colour "
                  << of_one_colour << "\n";
        EXPECT_LE(off, 0.003) << ring;
        worst_of_one_colour = std::max(worst_of_one_colour, of_one_colour);
    }
    EXPECT_GT(worst_of_one_colour, 0.02) << "what this test is to refuse";
}

}  // namespace coloured_rays_test
}  // namespace lucerna
