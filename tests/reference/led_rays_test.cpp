// Tests real ray files as light fields: the account of their flux, the remaining noise, and whether the field
// casts the irradiance of the rays.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "engine/base/sampler.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"
#include "tests/support/shared_data.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace led_rays_test {

// Returns a random half of the rays with twice the flux, because files have patterns in their order.
RaySet half_of(const RaySet& set, std::uint32_t which) {
    RaySet half = set;
    half.rays.clear();
    for (std::size_t i = 0; i < set.rays.size(); ++i) {
        if (Sampler(18, Purpose::test, 0, i).bits() % 2 == which) half.rays.push_back(set.rays[i]);
    }
    const double factor = static_cast<double>(set.rays.size()) / static_cast<double>(half.rays.size());
    for (LampRay& ray : half.rays) ray.flux = static_cast<float>(double{ray.flux} * factor);
    return half;
}

TEST(FitLightField, RealFiles_AreAccountedFor) {
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
                  << 1e3 * p.field.rig().spacing << " mm apart, " << p.field.rig().pixels << " pixels\n";
        for (const PlaneError& e : p.field.info().errors)
            std::cout << "  " << 1e3 * e.distance << " mm: " << 100 * e.relative() << " %\n";
        EXPECT_LT(std::fabs(unaccounted), 0.01) << name;
        // The cylinder emits half of its light backwards, and much of the rest sideways.
        const double share = a.captured / a.total;
        if (std::string_view(name).starts_with("osram"))
            EXPECT_GT(share, 0.995) << name;
        else
            EXPECT_GT(share, 0.38) << name;
    }
}

// --- the near pattern

// Tests whether the field of one half of the rays casts what the other half does: the difference of two
// independent halves, bin by bin, over the sum of their variances.
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
    // The variance of a sum of rays' fluxes is the sum of their squares, which are projected here.
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
    result.p_value = testing::chi_square_tail(result.statistic, result.degrees);
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
        for (const Case& c : {Case{1e-4, 0.006, 6}, Case{1e-3, 0.006, 6}, Case{0.005, 0.02, 10},
                              Case{0.05, 0.2, 10}, Case{0.5, 2, 10}, Case{5, 20, 10}}) {
            const auto fits = near_pattern(field, one, other, c.distance, c.size, c.bins);
            const double off = c.size / c.bins / 3;
            const auto shifted = near_pattern(field, one, other, c.distance, c.size, c.bins, {off, 0});
            // A field with less noise than its rays leaves about half of the statistic, so that 8 % would
            // pass.
            const auto scaled = near_pattern(field, one, other, c.distance, c.size, c.bins, {0, 0}, 1.1);
            std::cout << name << " at " << 1e3 * c.distance << " mm: chi-square " << fits.statistic << " of "
                      << fits.degrees << " degrees, p " << fits.p_value << "; shifted by a third of a bin "
                      << shifted.statistic << ", scaled by 1.1 " << scaled.statistic << "\n";
            EXPECT_TRUE(fits.accepted()) << name << " at " << c.distance << " m";
            EXPECT_FALSE(shifted.accepted()) << name << " at " << c.distance << " m";
            EXPECT_FALSE(scaled.accepted()) << name << " at " << c.distance << " m";
        }
    }
}

}  // namespace led_rays_test
}  // namespace lucerna
