// Where the planes go for a ray set, how fine they are cut, and what noise is left.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/warp.h"
#include "lights/plane_irradiance.h"
#include "lights/ray_projection.h"
#include "lights/ray_resolution.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/shared_data.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace {

using ::testing::HasSubstr;

// A square of light at height z = `waist`, cos^n rays through it that start at height `start`.
RaySet bundle(double half, double waist, double start, double exponent, int count, std::uint64_t seed) {
    RaySet set;
    set.flux = 100;
    set.unit = FluxUnit::lumen;
    for (int i = 0; i < count; ++i) {
        Stream stream(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f a = stream.next2(), b = stream.next2();
        const double z = std::pow(1 - double{b.x}, 1 / (exponent + 1)), r = std::sqrt(1 - z * z);
        const double turn = 2 * M_PI * double{b.y};
        const V3d d(r * std::cos(turn), r * std::sin(turn), z);
        const V3d o = V3d(half * (2 * double{a.x} - 1), half * (2 * double{a.y} - 1), waist) +
                      d * ((start - waist) / z);
        set.rays.push_back({V3f(o), V3f(d), static_cast<float>(set.flux / count)});
    }
    return set;
}

// Half of the rays, standing for all. By lot: files have patterns in their order.
RaySet half_of(const RaySet& set, std::uint32_t which) {
    RaySet half = set;
    half.rays.clear();
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (Stream(18, Purpose::test, 0, i).bits() % 2 == which) half.rays.push_back(set.rays[i]);
    }
    const double factor = static_cast<double>(set.rays.size()) / static_cast<double>(half.rays.size());
    for (LampRay& ray : half.rays) ray.flux = static_cast<float>(double{ray.flux} * factor);
    return half;
}

TEST(Waist, OfABundle_IsWhereItsLinesAreClosest) {
    for (const double waist : {-0.03, 0.0, 0.02}) {
        const RaySet set = bundle(0.001, waist, 0.005, 3, 20000, 11);
        const Waist found = waist_of(set);
        // The mean slope of so many rays is off by 1/√N of its spread; so is the height, of the square's
        // size.
        EXPECT_NEAR(found.z, waist, 1e-4);
        EXPECT_NEAR(found.spread, 0.001 * std::sqrt(2.0 / 3), 5e-5);  // of a square of half size 1 mm
    }
}

TEST(Waist, ParallelRays_IsWhereTheyStart) {
    RaySet set;
    set.flux = 2;
    set.rays = {{{0, 0, 1}, {0, 0, 1}, 1}, {{1, 0, 3}, {0, 0, 1}, 1}};
    EXPECT_NEAR(waist_of(set).z, 2, 1e-12);
}

TEST(ChooseRig, S_StandsAtTheWaistButNotBehindWhatEmits) {
    Monitor silent;
    // A waist before the lamp: there. One behind its front (a virtual focus): at the front.
    EXPECT_NEAR(choose_rig(bundle(0.001, 0.02, 0, 50, 20000, 12), {}, silent).centre.z, 0.02, 1e-3);
    EXPECT_NEAR(choose_rig(bundle(0.001, -0.001, 0, 2, 20000, 13), {}, silent).centre.z, 0, 1e-6);
    // Rays that start on a far surface around the lamp do not tell where it ends: at the waist.
    EXPECT_NEAR(choose_rig(bundle(0.001, 0, 0.3, 5, 20000, 14), {}, silent).centre.z, 0, 1e-4);
}

TEST(ChooseRig, NoiseLimit_IsKeptAndUsed) {
    Monitor silent;
    double finer = 0;
    for (const int count : {20000, 200000}) {
        const RaySet set = bundle(0.002, 0, 0, 2, count, 15);
        for (const double limit : {0.1, 0.2}) {
            FitOptions options;
            options.noise = limit;
            const Projection p = fit_light_field(set, options, {}, silent);
            EXPECT_LE(p.noise, 1.03 * limit) << count;  // the choice may have looked at fewer rays
            EXPECT_GE(p.field.rig().views.x, 4);
            const double coefficients = static_cast<double>(p.field.rig().coefficients());
            if (limit == 0.2) {
                EXPECT_GT(coefficients, 2 * finer) << count;
                finer = coefficients;
            }
        }
    }
}

TEST(ChooseRig, TooFewRays_TakesTheCoarsestAndSaysSo) {
    testing::ListeningMonitor monitor;
    FitOptions options;
    options.noise = 0.01;
    const Rig rig = choose_rig(bundle(0.002, 0, 0, 2, 50, 16), options, monitor);
    EXPECT_EQ(rig.views, V2i(4, 4));
    ASSERT_EQ(monitor.warnings.size(), 1U);
    EXPECT_THAT(monitor.warnings[0], HasSubstr("too few for a noise of 1 %"));
}

// What two halves of the rays differ by, turned into the noise of all of them.
double noise_of_halves(const RaySet& set, const Rig& rig) {
    Monitor silent;
    const LightField a = project_rays(half_of(set, 0), rig, {}, silent).field;
    const LightField b = project_rays(half_of(set, 1), rig, {}, silent).field;
    double difference = 0, square = 0;
    for (std::size_t i = 0; i < a.coefficients().size(); ++i) {
        const double x = double{a.coefficients()[i]}, y = double{b.coefficients()[i]};
        difference += sqr(x - y) / 4;  // each half has twice the variance of the whole
        square += sqr((x + y) / 2);
    }
    return std::sqrt(difference / (square - difference));
}

TEST(ProjectRays, NoisePredicted_IsWhatTwoHalvesDifferBy) {
    Monitor silent;
    for (const double limit : {0.1, 0.3}) {
        const RaySet set = bundle(0.002, 0, 0, 2, 40000, 17);
        FitOptions options;
        options.noise = limit;
        const Rig rig = choose_rig(set, options, silent);
        const double predicted = project_rays(set, rig, {}, silent).noise;
        // Thousands of coefficients make one sum of squares: 5 % is many of its standard errors, and a
        // prediction that forgot the dual's norm (1.88) or took rays for coefficients would be far off.
        EXPECT_NEAR(noise_of_halves(set, rig) / predicted, 1, 0.05) << limit;
    }
}

TEST(FitLightField, RealFiles_AreAccountedForAndTheirNoiseIsAsPredicted) {
    for (const char* name :
         {"osram-ostar-green-100k.tm25ray", "osram-ostar-blue-100k.tm25ray", "cylinder-10k.tm25ray"}) {
        LUCERNA_NEED_DATA(file, name);
        Monitor silent;
        const RaySet set = read_rays(file, silent);
        const Projection p = fit_light_field(set, {}, {}, silent);
        const FluxAccount& a = p.account;
        const double losses = a.skipped + a.backward + a.beside_s + a.beside_m;
        const double unaccounted = (a.total - a.captured - losses) / a.total;
        std::cout << name << ": captured " << 100 * a.captured / a.total << " %, beside S "
                  << 100 * a.beside_s / a.total << " %, beside M " << 100 * a.beside_m / a.total
                  << " %, backward " << 100 * a.backward / a.total << " %, unaccounted " << 100 * unaccounted
                  << " %; S at " << 1e3 * p.field.rig().centre << " mm; " << p.field.rig().views << " views "
                  << 1e3 * p.field.rig().spacing << " mm apart, " << p.field.rig().pixels << " pixels; noise "
                  << 100 * p.noise << " %, of halves " << 100 * noise_of_halves(set, p.field.rig()) << " %\n";
        EXPECT_LT(std::fabs(unaccounted), 0.01) << name;
        EXPECT_LE(p.noise, 0.2 * 1.03) << name;
        // The cylinder's rays are few and of unequal flux.
        EXPECT_NEAR(noise_of_halves(set, p.field.rig()) / p.noise, 1, set.rays.size() < 50000 ? 0.15 : 0.05)
            << name;
        // The cylinder sends half of its light backwards, and much of the rest sideways.
        const double share = a.captured / a.total;
        if (std::string_view(name).starts_with("osram"))
            EXPECT_GT(share, 0.99) << name;
        else
            EXPECT_GT(share, 0.38) << name;
    }
}

// --- the near pattern
// --------------------------------------------------------------------------------------------

// Does the field of one half of the rays cast what the other half does? The difference of two independent
// halves, bin by bin, over the sum of their variances.
testing::ChiSquare near_pattern(const LightField& field, const RaySet& fitted, const RaySet& other,
                                double distance, double size, int bins, const V2d& shift = V2d(0, 0),
                                double scale = 1) {
    Monitor silent;
    const V3d centre = field.rig().centre;
    PlanePatch patch;
    patch.distance = distance;
    patch.size = {size, size};
    patch.pixels = {bins, bins};
    patch.centre = shift;
    const PlaneIrradiance cast = project(field, patch, {}, silent);
    patch.distance += centre.z;
    patch.centre = V2d(centre.x, centre.y);
    const PlaneIrradiance counted = project(other, patch);
    // The variance of a sum of rays' fluxes is the sum of their squares: project those.
    const auto squared = [&](RaySet set) {
        for (LampRay& ray : set.rays) ray.flux *= ray.flux;
        return project(set, patch);
    };
    const PlaneIrradiance a = squared(fitted), b = squared(other);
    testing::ChiSquare result;
    const double area = patch.pixel_area();
    for (std::size_t i = 0; i < counted.values.size(); ++i) {
        const double variance = (a.values[i] + b.values[i]) / area;
        if (!(b.values[i] * area > 20 * sqr(double{other.rays[0].flux}))) continue;  // 20 rays make it normal
        result.statistic += sqr(scale * cast.values[i] - counted.values[i]) / variance;
        ++result.degrees;
    }
    const boost::math::chi_squared distribution(result.degrees);
    result.p_value = boost::math::cdf(boost::math::complement(distribution, result.statistic));
    return result;
}

TEST(FitLightField, OsramLeds_CastWhatTheirRaysDoWithinTheRaysNoise) {
    for (const char* name : {"osram-ostar-green-100k.tm25ray", "osram-ostar-blue-100k.tm25ray"}) {
        LUCERNA_NEED_DATA(file, name);
        Monitor silent;
        const RaySet set = read_rays(file, silent);
        const RaySet one = half_of(set, 0), other = half_of(set, 1);
        const LightField field = fit_light_field(one, {}, {}, silent).field;
        struct Case {
            double distance, size;
            int bins;
        };
        for (const Case& c :
             {Case{1e-4, 0.006, 6}, Case{1e-3, 0.006, 6}, Case{0.01, 0.04, 10}, Case{1, 4, 10}}) {
            const auto fits = near_pattern(field, one, other, c.distance, c.size, c.bins);
            const double off = c.size / c.bins / 3;
            const auto shifted = near_pattern(field, one, other, c.distance, c.size, c.bins, {off, 0});
            const auto scaled = near_pattern(field, one, other, c.distance, c.size, c.bins, {0, 0}, 1.08);
            std::cout << name << " at " << 1e3 * c.distance << " mm: chi-square " << fits.statistic << " of "
                      << fits.degrees << " degrees, p " << fits.p_value << "; shifted by a third of a bin "
                      << shifted.statistic << ", scaled by 1.08 " << scaled.statistic << "\n";
            EXPECT_TRUE(fits.accepted()) << name << " at " << c.distance << " m";
            EXPECT_FALSE(shifted.accepted()) << name << " at " << c.distance << " m";
            EXPECT_FALSE(scaled.accepted()) << name << " at " << c.distance << " m";
        }
    }
}

}  // namespace
}  // namespace lucerna
