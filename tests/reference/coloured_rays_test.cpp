// Tests light fields in colour that are made of rays of several colours: near and far, against the known
// lamp.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/colour/chromaticity.h"
#include "engine/colour/spectrum.h"
#include "lights/measurement/emit_rays.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace coloured_rays_test {

// A white LED by formula, in lumens: a blue square of half side 0.5 mm whose intensity falls as cos²,
// surrounded by a Lambertian yellow disc of radius 1.5 mm.
constexpr double kBlueFlux = 3, kYellowFlux = 97, kSide = 0.5e-3, kRing = 1.5e-3;
const V3d kBlue(0.16 / 0.03, 1, 0.81 / 0.03), kYellow(0.44 / 0.54, 1, 0.02 / 0.54);  // XYZ, Y = 1

RaySet white_led(int count, std::uint64_t seed) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = kBlueFlux + kYellowFlux;
    set.xyz = (kBlueFlux * kBlue + kYellowFlux * kYellow) / set.flux;
    // A fourth of the rays are blue, with less flux each.
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

// Compares rays counted in rings of ten degrees about the axis with the field's intensity over each.
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

// The lamp of scenes/lamps/white-led/make.py: 0.24 W of blue light from a square of 1 mm, cos² about the
// axis, and 0.76 W of the phosphor's yellow from a disc of 3.5 mm, Lambertian, half as dense over the square.
V3d gaussian_light(double peak, double below, double above) {
    Spectrum spectrum;
    for (int nm = kFirstVisible; nm <= kLastVisible; ++nm) {
        const double sigma = nm < peak ? below : above;
        spectrum.push_back({double(nm), std::exp(-0.5 * sqr((nm - peak) / sigma))});
    }
    return spectrum_to_xyz(spectrum) * (1 / (std::sqrt(M_PI / 2) * (below + above)));  // per watt
}
RaySet made_led(int count, std::uint64_t seed) {
    const V3d blue_light = gaussian_light(450, 8.5, 10.5), phosphor = gaussian_light(560, 38, 62);
    const V3d all = 0.24 * blue_light + 0.76 * phosphor;
    RaySet set;
    set.flux = 1;
    set.xyz = all / all.y;
    set.lumens_per_watt = 683 * all.y;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 1, static_cast<std::uint64_t>(i));
        const bool blue = double{sampler.next()} < 0.24;
        V2d at;
        for (bool found = false; !found;) {
            const V2f u = sampler.next2();
            at = (blue ? 0.5e-3 : 1.75e-3) * V2d(2 * double{u.x} - 1, 2 * double{u.y} - 1);
            const bool over_core = std::max(std::fabs(at.x), std::fabs(at.y)) < 0.5e-3;
            found = blue || (at.length() < 1.75e-3 && (!over_core || double{sampler.next()} < 0.5));
        }
        const V2f u = sampler.next2();
        const double z = std::pow(1 - double{u.x}, 1.0 / (blue ? 3 : 2)), r = std::sqrt(1 - z * z);
        const double turn = 2 * M_PI * double{u.y};
        set.rays.push_back({V3f(V3d(at.x, at.y, 0)), V3f(V3d(r * std::cos(turn), r * std::sin(turn), z)),
                            static_cast<float>(1.0 / count)});
        set.tristimulus.push_back(V3f((blue ? blue_light : phosphor) / all.y));
    }
    return set;
}

// For every pixel of a plane, the sums of the rays' light and of its squares by channel, and the number of
// rays.
struct CountedPlane {
    std::vector<V3d> sum, squares;
    std::vector<int> rays;
};
CountedPlane count_rays(const RaySet& set, const PlanePatch& patch) {
    const auto pixels = static_cast<std::size_t>(patch.pixels.x * patch.pixels.y);
    CountedPlane counted{std::vector<V3d>(pixels, V3d(0)), std::vector<V3d>(pixels, V3d(0)),
                         std::vector<int>(pixels)};
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        const LampRay& ray = set.rays[i];
        const V2d at = V2d(double{ray.o.x}, double{ray.o.y}) +
                       V2d(double{ray.d.x}, double{ray.d.y}) * (patch.distance / double{ray.d.z});
        const int x = static_cast<int>(std::floor(((at.x / patch.size.x) + 0.5) * patch.pixels.x));
        const int y = static_cast<int>(std::floor(((at.y / patch.size.y) + 0.5) * patch.pixels.y));
        if (x < 0 || y < 0 || x >= patch.pixels.x || y >= patch.pixels.y) continue;
        const auto b = static_cast<std::size_t>(y * patch.pixels.x + x);
        const V3d light = double{ray.flux} * set.xyz_of(i);
        counted.sum[b] += light;
        counted.squares[b] += V3d(sqr(light.x), sqr(light.y), sqr(light.z));
        ++counted.rays[b];
    }
    return counted;
}

// Returns the chi-square of the irradiance that the field casts on a plane against rays from which it was not
// made. It is made of as many rays, whose noise doubles the variance.
testing::ChiSquare against_rays(const LightField& channel, int c, const CountedPlane& counted,
                                PlanePatch patch) {
    constexpr int kFewest = 25;
    Monitor silent;
    patch.distance -= channel.rig().centre.z;
    patch.centre -= V2d(channel.rig().centre.x, channel.rig().centre.y);
    const PlaneIrradiance cast = project(channel, patch, {}, silent);
    testing::ChiSquare result;
    for (std::size_t b = 0; b < cast.values.size(); ++b) {
        if (counted.rays[b] < kFewest) continue;
        result.statistic +=
            sqr(cast.values[b] * patch.pixel_area() - counted.sum[b][c]) / (2 * counted.squares[b][c]);
        ++result.degrees;
    }
    result.p_value = testing::chi_square_tail(result.statistic, result.degrees);
    return result;
}

// Returns planes at 2 mm and at 1 m, with pixels wider than the resolution of so many rays.
std::vector<PlanePatch> two_walls() {
    return {{0.002, {0, 0}, {0.012, 0.012}, {8, 8}}, {1, {0, 0}, {4, 4}, {10, 10}}};
}

TEST(ColouredRays, WhiteLed_CastsWhatTheHeldOutHalfOfItsRaysCarry) {
    Monitor silent;
    constexpr int kHalf = 100'000;
    const RaySet half = made_led(kHalf, 11), held_out = made_led(kHalf, 12);
    const LightField field = fit_light_field(half, {}, {}, silent).field;
    ASSERT_TRUE(field.coloured());
    for (const PlanePatch& wall : two_walls()) {
        const CountedPlane counted = count_rays(held_out, wall);
        for (int c = 0; c < 3; ++c) {
            const testing::ChiSquare right = against_rays(field.channel(c), c, counted, wall);
            std::cout << "at " << wall.distance << " m, channel " << c << ": chi-square " << right.statistic
                      << " of " << right.degrees << ", p " << right.p_value << "\n";
            EXPECT_TRUE(right.accepted()) << wall.distance << " " << c;
            if (c != 1) {
                EXPECT_FALSE(against_rays(field.channel(2 - c), c, counted, wall).accepted())
                    << "X and Z swapped";
            }
        }
        // The lamp in one colour is rejected.
        LightFieldInfo info;
        info.colour = half.colour();
        const LightField grey = LightField(field.channel(1)).with(info);
        EXPECT_FALSE(against_rays(grey.channel(2), 2, counted, wall).accepted());
    }
}

// Returns particles as photon maps receive them, by the lines on which they leave the lamp.
RaySet particles_of(const LightField& field, std::uint64_t count) {
    Monitor silent;
    const LampEmission lamp(field, "white LED", EmissionMode::exact, 3, {}, silent);
    RayBlock block = lamp.draw(0, count);
    double sum = 0;
    for (const LampRay& ray : block.rays) sum += double{ray.flux};
    const auto factor = static_cast<float>(field.flux() / sum);
    for (LampRay& ray : block.rays) ray.flux *= factor;
    RaySet set;
    set.rays = std::move(block.rays);
    set.tristimulus = std::move(block.tristimulus);
    return set;
}

// Both are samples of the lamp's light, and the field from which the particles are drawn is made of as many
// rays; the variance is the sum of all three.
testing::ChiSquare against_particles(const CountedPlane& particles, const CountedPlane& counted, int c) {
    constexpr int kFewest = 25;
    testing::ChiSquare result;
    for (std::size_t b = 0; b < counted.rays.size(); ++b) {
        if (counted.rays[b] < kFewest) continue;
        result.statistic += sqr(particles.sum[b][c] - counted.sum[b][c]) /
                            (2 * counted.squares[b][c] + particles.squares[b][c]);
        ++result.degrees;
    }
    result.p_value = testing::chi_square_tail(result.statistic, result.degrees);
    return result;
}

TEST(ColouredRays, WhiteLed_SendsParticlesOfTheColoursOfItsRays) {
    Monitor silent;
    constexpr int kHalf = 100'000;
    const RaySet half = made_led(kHalf, 13), held_out = made_led(kHalf, 14);
    const LightField field = fit_light_field(half, {}, {}, silent).field;
    const RaySet particles = particles_of(field, kHalf);
    for (const PlanePatch& wall : two_walls()) {
        const CountedPlane rendered = count_rays(particles, wall), counted = count_rays(held_out, wall);
        double off = 0, of_one_colour = 0, weight = 0;
        for (std::size_t b = 0; b < counted.rays.size(); ++b) {
            if (counted.rays[b] < 400) continue;
            const double y = counted.sum[b].y;
            off += y * sqr(off_in_colour(rendered.sum[b], counted.sum[b]));
            of_one_colour += y * sqr(off_in_colour(half.xyz, counted.sum[b]));
            weight += y;
        }
        std::cout << "at " << wall.distance << " m: du'v' " << std::sqrt(off / weight) << ", of one colour "
                  << std::sqrt(of_one_colour / weight) << "\n";
        for (int c = 0; c < 3; ++c) {
            const testing::ChiSquare right = against_particles(rendered, counted, c);
            std::cout << "  channel " << c << ": chi-square " << right.statistic << " of " << right.degrees
                      << ", p " << right.p_value << "\n";
            EXPECT_TRUE(right.accepted()) << wall.distance << " " << c;
            if (c == 1) continue;
            CountedPlane swapped = rendered;
            for (std::vector<V3d>* values : {&swapped.sum, &swapped.squares}) {
                for (V3d& value : *values) std::swap(value.x, value.z);
            }
            EXPECT_FALSE(against_particles(swapped, counted, c).accepted()) << "X and Z swapped";
        }
        // Single pixels have chromaticity noise of about that size.
        EXPECT_LT(std::sqrt(off / weight), 0.01);
        EXPECT_GT(std::sqrt(of_one_colour / weight), 0.015) << "what this test is to refuse";
    }
}

}  // namespace coloured_rays_test
}  // namespace lucerna
