// Compares the irradiance that fitted light fields cast on planes, from the near to the far field, with
// independent rays of the same lamps; tests the smoothness and the sharpness of the fields.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"
#include "tests/support/lamp_rays.h"
#include "tests/support/shared_data.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace fitted_lamps_test {

using testing::lambertian;

// Returns rays of scenes/lamps/narrow-beam/make.py: a uniform disc of 20 mm whose intensity is a Gaussian of
// the angle, 2° wide.
RaySet narrow_beam(int count, std::uint64_t seed) {
    RaySet set;
    set.flux = 0.5;
    const double sigma = 2 * M_PI / 180 / (2 * std::sqrt(2 * std::log(2)));
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2(), v = sampler.next2();
        const double r = 0.01 * std::sqrt(double{u.x}), phi = 2 * M_PI * double{u.y};
        const double angle = sigma * std::sqrt(-2 * std::log(1 - double{v.x})), turn = 2 * M_PI * double{v.y};
        set.rays.push_back(
            {V3f(V3d(r * std::cos(phi), r * std::sin(phi), 0)),
             V3f(V3d(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle))),
             static_cast<float>(set.flux / count)});
    }
    return set;
}

// Returns rays of scenes/lamps/bulb/make.py without reflections in the glass: a helix of wire that emits by
// Lambert's law, recorded on a sphere of 30 mm; none leave towards the cap.
RaySet bulb(int count, std::uint64_t seed) {
    constexpr double kLength = 0.012, kCoil = 0.5e-3, kWire = 0.075e-3, kTurns = 24, kGlass = 0.03;
    const double cap = std::cos(25 * M_PI / 180);
    RaySet set;
    set.flux = 4;
    for (std::uint64_t i = 0; set.rays.size() < static_cast<std::size_t>(count); ++i) {
        Sampler sampler(seed, Purpose::test, 1, i);
        const V2f u = sampler.next2();
        const double a = 2 * M_PI * kTurns * double{u.x}, b = 2 * M_PI * double{u.y};
        const V3d out(0, std::cos(a), std::sin(a));
        const double rate = kLength / (2 * M_PI * kTurns);
        const V3d tangent = V3d(rate, -kCoil * std::sin(a), kCoil * std::cos(a)).normalized();
        const V3d normal = std::cos(b) * out + std::sin(b) * tangent.cross(out);
        const V3d p = V3d(kLength * (double{u.x} - 0.5), 0, 0) + kCoil * out + kWire * normal;
        const V3d d = lambertian(normal, sampler.next2());
        const double along = p.dot(d);
        const V3d glass = p + (-along + std::sqrt(along * along - p.dot(p) + kGlass * kGlass)) * d;
        if (glass.z < -cap * kGlass) continue;
        set.rays.push_back({V3f(glass), V3f(d), static_cast<float>(set.flux / count)});
    }
    return set;
}

// Returns rays of a uniform square of 2 mm that emits by Lambert's law.
RaySet square(int count, std::uint64_t seed) {
    RaySet set;
    set.flux = 1;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 2, static_cast<std::uint64_t>(i));
        const V2f u = sampler.next2();
        set.rays.push_back({V3f(V3d(0.002 * (double{u.x} - 0.5), 0.002 * (double{u.y} - 0.5), 0)),
                            V3f(lambertian({0, 0, 1}, sampler.next2())), static_cast<float>(1.0 / count)});
    }
    return set;
}

RaySet seen_along(const RaySet& set, const SlabAxes& axes) {
    RaySet turned = set;
    for (LampRay& ray : turned.rays) {
        ray.o = V3f(axes.to_slab(V3d(ray.o)));
        ray.d = V3f(axes.to_slab(V3d(ray.d)));
    }
    return turned;
}

// Tests whether the irradiance that a lamp casts on a plane agrees with the rays in `other`, if its field is
// made of as many rays: bin by bin, over twice the counting variance. Bins of fewer than 20 rays are left
// out, in which counts are not normal.
testing::ChiSquare against(const PlaneIrradiance& cast, const RaySet& other, const PlanePatch& patch,
                           double scale = 1) {
    const PlaneIrradiance counted = project(other, patch);
    const double ray = double{other.rays[0].flux}, area = patch.pixel_area();
    testing::ChiSquare result;
    for (std::size_t i = 0; i < counted.values.size(); ++i) {
        const double rays = counted.values[i] * area / ray;
        if (!(rays > 20)) continue;
        result.statistic += sqr(scale * cast.values[i] * area / ray - rays) / (2 * rays);
        ++result.degrees;
    }
    result.p_value = testing::chi_square_tail(result.statistic, result.degrees);
    return result;
}

// Expects that the irradiance is accepted, and rejected if it is shifted by `part` of a bin or scaled by
// `factor`.
template <typename Cast>
void expect_cast(const char* name, const PlanePatch& patch, const RaySet& other, double part, double factor,
                 Cast&& cast) {
    const auto fits = against(cast(patch), other, patch);
    const auto scaled = against(cast(patch), other, patch, factor);
    PlanePatch aside = patch;
    aside.centre.x += part * patch.size.x / patch.pixels.x;
    const auto shifted = against(cast(aside), other, patch);
    std::cout << name << " at " << 1e3 * patch.distance << " mm: chi-square " << fits.statistic << " of "
              << fits.degrees << ", p " << fits.p_value << "; shifted " << shifted.statistic << ", scaled "
              << scaled.statistic << "\n";
    EXPECT_GE(fits.degrees, 20) << name << patch.distance;
    EXPECT_TRUE(fits.accepted()) << name << patch.distance;
    EXPECT_FALSE(shifted.accepted()) << name << patch.distance;
    EXPECT_FALSE(scaled.accepted()) << name << patch.distance;
}

// The mean over several lamps, because the error of one depends on its rays.
TEST(FittedLamp, NarrowBeamsOf20000Rays_CastWhatOtherRaysDo) {
    constexpr int kRays = 20'000;
    // The statistic per degree is (1 + e) / 2 for a field whose squared error is e times the variance of
    // counting its rays. Far away, bins are wide beside the cells in which the choice of the resolution
    // counts, and rays that are counted in them are hard to beat.
    constexpr double kMost = 1.6;
    Monitor silent;
    struct Case {
        double distance, size;
        RunningStats fits, shifted, scaled;
    };
    std::array<Case, 4> cases{Case{0.005, 0.02, {}, {}, {}}, Case{0.05, 0.022, {}, {}, {}},
                              Case{0.5, 0.05, {}, {}, {}}, Case{5, 0.4, {}, {}, {}}};
    for (const std::uint64_t seed : {1, 3, 5, 7, 9, 11}) {
        const LightField field = fit_light_field(narrow_beam(kRays, seed), {}, {}, silent).field;
        const RaySet other = narrow_beam(kRays, seed + 1);
        const V3d centre = field.rig().centre;
        for (Case& c : cases) {
            const PlanePatch patch{c.distance, {0, 0}, {c.size, c.size}, {8, 8}};
            const auto per_degree = [&](PlanePatch at, double factor) {
                at.distance -= centre.z;
                at.centre -= V2d(centre.x, centre.y);
                const auto chi2 = against(project(field, at, {}, silent), other, patch, factor);
                EXPECT_GE(chi2.degrees, 20);
                return chi2.statistic / chi2.degrees;
            };
            c.fits.add(per_degree(patch, 1));
            c.scaled.add(per_degree(patch, 1.1));
            PlanePatch aside = patch;
            aside.centre.x += patch.size.x / patch.pixels.x / 3;
            c.shifted.add(per_degree(aside, 1));
        }
    }
    for (const Case& c : cases) {
        std::cout << "narrow beams at " << 1e3 * c.distance << " mm: chi-square per degree " << c.fits.mean()
                  << " +- " << c.fits.standard_error() << "; shifted " << c.shifted.mean() << ", scaled "
                  << c.scaled.mean() << "\n";
        EXPECT_LT(c.fits.mean(), kMost) << c.distance;
        EXPECT_GT(c.shifted.mean(), kMost) << c.distance;
        EXPECT_GT(c.scaled.mean(), kMost) << c.distance;
    }
}

TEST(FittedLamp, Bulb_CastsWhatOtherRaysDoToEverySide) {
    constexpr int kRays = 100'000;
    Monitor silent;
    const RaySet other = bulb(kRays, 2);
    const LumigraphFit made = fit_lumigraph(bulb(kRays, 1), {}, {}, silent);
    EXPECT_GT(made.account.captured, 0.99 * made.account.total);
    EXPECT_NEAR(made.account.explained(), made.account.missed(), 1e-3 * made.account.total);
    for (const int side : {0, 2, 4, 5}) {
        const SlabAxes axes = SlabAxes::facing(side);
        const RaySet seen = seen_along(other, axes);
        const double face =
            axes.n.dot(axes.n.x + axes.n.y + axes.n.z > 0 ? made.lamp.box().max : made.lamp.box().min);
        for (const double distance : {0.005, 0.05, 0.5, 5.0}) {
            const double size = 2 * (0.006 + distance);
            const PlanePatch patch{face + distance, {0, 0}, {size, size}, {5, 5}};
            // The light is smooth: a shift of a third of a bin would not be detected. 12,000 rays or more
            // meet the plane.
            expect_cast(("bulb " + axes.name()).c_str(), patch, seen, 1, 1.1,
                        [&](const PlanePatch& at) { return project(made.lamp, axes, at, {}, silent); });
        }
    }
}

// Returns the largest step of the intensity between directions half a degree apart, over the peak.
double largest_step(const LightField& field) {
    double peak = 0, step = 0;
    for (int turn = 0; turn < 16; ++turn) {
        const double phi = turn * M_PI / 8 + 0.1;
        double last = 0;
        for (int i = 0; i <= 150; ++i) {
            const double slope = std::tan(i * 0.5 * M_PI / 180);
            const double now = far_intensity(field, slope * V2d(std::cos(phi), std::sin(phi)));
            peak = std::max(peak, now);
            if (i > 0) step = std::max(step, std::fabs(now - last));
            last = now;
        }
    }
    return step / peak;
}

TEST(FittedLamp, FarFieldOfASmoothLamp_HasNoSteps) {
    Monitor silent;
    // The largest step of one field depends on its rays; the mean of several does so less.
    RunningStats step, of_boxes;
    for (const std::uint64_t seed : {3, 4, 5, 6, 7, 8}) {
        const RaySet rays = square(100'000, seed);
        step.add(largest_step(fit_light_field(rays, {}, {}, silent).field));
        // The field without a fit: rays counted in boxes.
        Rig boxes;
        boxes.views = {48, 48};
        boxes.spacing = V2d(0.0025 / 45);
        boxes.pixels = {38, 38};
        boxes.distance = 0.05;
        boxes.pixel = V2d(2 * boxes.distance * std::tan(80 * M_PI / 180) / 38);
        of_boxes.add(largest_step(project_rays(rays, boxes, {}, silent).field));
    }
    std::cout << "steps of " << 100 * step.mean() << " % of the peak per half degree; of even boxes "
              << 100 * of_boxes.mean() << " %\n";
    EXPECT_LT(step.mean(), 0.02);
    EXPECT_GT(of_boxes.mean(), 0.02) << "the test must refuse even boxes";
}

TEST(FittedLamp, FarFieldsOfMeasuredLeds_HaveNoSteps) {
    for (const char* name : {"osram-ostar-green-100k.tm25ray", "osram-ostar-blue-100k.tm25ray"}) {
        LUCERNA_NEED_DATA(file, name);
        Monitor silent;
        const double step = largest_step(fit_light_field(read_rays(file, silent), {}, {}, silent).field);
        std::cout << name << ": steps of " << 100 * step << " % of the peak per half degree\n";
        EXPECT_LT(step, 0.02) << name;
    }
}

// Returns the distance over which the irradiance across an edge rises from 10 to 90 % of its largest value.
// The profile is sampled at a constant step, with rising x.
double rise_of(const std::vector<double>& profile, double step) {
    const double high = *std::max_element(profile.begin(), profile.end());
    double from = 0, to = 0;
    for (std::size_t i = 1; i < profile.size(); ++i) {
        const auto crosses = [&](double level) { return profile[i - 1] < level && profile[i] >= level; };
        const auto place = [&](double level) {
            return (static_cast<double>(i) - (profile[i] - level) / (profile[i] - profile[i - 1])) * step;
        };
        if (from == 0 && crosses(0.1 * high)) from = place(0.1 * high);
        if (to == 0 && crosses(0.9 * high)) to = place(0.9 * high);
    }
    return to - from;
}

// Returns the irradiance along a strip across the chip's left edge, over the middle of its height.
std::vector<double> across_edge(const PlaneIrradiance& strip) {
    std::vector<double> profile;
    for (int x = 0; x < strip.patch.pixels.x; ++x) profile.push_back(strip.at(x, 0));
    return profile;
}

// Returns the root mean square of the difference over the largest value.
double difference(const std::vector<double>& profile, const std::vector<double>& own) {
    double square = 0;
    for (std::size_t i = 0; i < own.size(); ++i) square += sqr(profile[i] - own[i]);
    return std::sqrt(square / static_cast<double>(own.size())) / *std::max_element(own.begin(), own.end());
}

// Rays of a chip defined by formula are unlimited, so its edge is known accurately.
TEST(FittedLamp, ChipsEdges_AreKeptAtATenthOfAMillimetre) {
    Monitor silent;
    constexpr double kStep = 40e-6;
    const PlanePatch strip{1e-4, {-0.00085, 0}, {30 * kStep, 0.0008}, {30, 1}};
    const auto of_field = [&](const LightField& field) {
        PlanePatch at = strip;
        at.distance -= field.rig().centre.z;
        at.centre -= V2d(field.rig().centre.x, field.rig().centre.y);
        return across_edge(project(field, at, {}, silent));
    };
    const auto own = across_edge(project(square(4'000'000, 5), strip));
    const RaySet rays = square(100'000, 4);
    const auto counted = across_edge(project(rays, strip));
    const LightField field = fit_light_field(rays, {}, {}, silent).field;
    const auto kept = of_field(field);
    Rig coarse = field.rig();  // filters half a millimetre apart
    coarse.s_coordinate.c = 0;
    coarse.views = {9, 9};
    coarse.spacing = V2d(0.0005);
    const auto blurred = of_field(project_rays(rays, coarse, {}, silent).field);
    std::cout << "a chip's edge 0.1 mm before it: rises from 10 to 90 % over " << 1e6 * rise_of(own, kStep)
              << " um, of the field " << 1e6 * rise_of(kept, kStep) << " um; off by "
              << 100 * difference(kept, own) << " %, its rays counted in cells of 40 um by "
              << 100 * difference(counted, own) << " %, a field with filters 0.5 mm apart by "
              << 100 * difference(blurred, own) << " %\n";
    // The field is closer to the chip than its own rays, counted in cells of that size.
    EXPECT_LT(difference(kept, own), difference(counted, own));
    EXPECT_GT(difference(blurred, own), difference(counted, own)) << "what this test is to refuse";
}

}  // namespace fitted_lamps_test
}  // namespace lucerna
