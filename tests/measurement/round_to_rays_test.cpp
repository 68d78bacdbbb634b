// Tests the rounding of coefficients to fractions of a ray: nothing negative, no light lost or moved
// noticeably.
#include "lights/measurement/round_to_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/measurement/plane_irradiance.h"
#include "lights/measurement/ray_projection.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace round_to_rays_test {

using namespace lucerna::testing;

constexpr double kFlux = 100;

// Returns rays of a disc of 2 mm that shines by Lambert's law.
RaySet disc_rays(int count, double flux = kFlux) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = flux;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(57, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2d p = 0.002 * V2d(square_to_disc(sampler.next2()));
        const V2f u = sampler.next2();
        const double z = std::sqrt(1 - double{u.x}), r = std::sqrt(double{u.x}),
                     turn = 2 * M_PI * double{u.y};
        set.rays.push_back({V3f(V3d(p.x, p.y, 0)), V3f(V3d(r * std::cos(turn), r * std::sin(turn), z)),
                            static_cast<float>(flux / count)});
    }
    return set;
}

Rig rig_of(int views, int pixels) {
    Rig rig;
    rig.views = {views, views};
    rig.pixels = {pixels, pixels};
    rig.spacing = V2d(0.004 / (views - 3));
    rig.distance = 0.02;
    rig.pixel = V2d(0.12 / pixels);
    rig.basis = PixelBasis::hat;
    return rig;
}

LightField projected(const RaySet& set, const Rig& rig, const RayWeights& weights = {}) {
    Monitor silent;
    return project_rays(set, rig, {}, silent, weights).field;
}

// Returns the field with coefficients rounded to multiples of the quantum, each by itself.
LightField rounded_singly(const LightField& field, double quantum) {
    std::vector<float> e(field.coefficients().begin(), field.coefficients().end());
    for (float& each : e)
        each = static_cast<float>(std::max(0.0, std::floor(double{each} / quantum + 0.5) * quantum));
    return LightField(field.rig(), e, field.info());
}

// Returns the least coefficient that is not 0.
double multiple_of(const LightField& field) {
    double least = INFINITY;
    for (const float e : field.coefficients())
        if (e != 0) least = std::min(least, double{e});
    return least;
}

// Returns the root mean square change of the irradiance on a square of 2 `half` relative to its own.
double change_on(double distance, double half, const LightField& from, const LightField& to) {
    Monitor silent;
    const PlanePatch patch{distance, {0, 0}, {2 * half, 2 * half}, {32, 32}};
    const PlaneIrradiance before = project(from, patch, {}, silent), after = project(to, patch, {}, silent);
    double change = 0, all = 0;
    for (std::size_t i = 0; i < before.values.size(); ++i)
        change += sqr(after.values[i] - before.values[i]), all += sqr(before.values[i]);
    return std::sqrt(change / all);
}

TEST(RoundToRays, Coefficients_AreMultiplesAndNoneIsNegative) {
    const RaySet set = disc_rays(20'000);
    const LightField exact = projected(set, rig_of(16, 12));
    ASSERT_LT(*std::min_element(exact.coefficients().begin(), exact.coefficients().end()), 0);
    const LightField rounded = rounded_to_rays(exact, set);
    const double ray = kFlux / 20'000 / exact.rig().cell_volume();
    const double quantum = multiple_of(rounded);
    EXPECT_GE(quantum, ray / 8 / std::sqrt(2.0));
    EXPECT_LE(quantum, ray / 8 * std::sqrt(2.0));
    for (std::size_t i = 0; i < rounded.coefficients().size(); ++i) {
        const float e = rounded.coefficients()[i];
        EXPECT_GE(e, 0) << i;
        EXPECT_EQ(std::fmod(double{e}, quantum), 0) << i;
        EXPECT_TRUE(exact.coefficients()[i] != 0 || e == 0) << i;
    }
}

TEST(RoundToRays, Flux_IsKeptInTheFieldAndInEachView) {
    const RaySet set = disc_rays(20'000);
    for (const double dual : {0.0, 1.0}) {
        const LightField exact = projected(set, rig_of(16, 12), {dual, dual});
        const LightField rounded = rounded_to_rays(exact, set);
        const double ray = kFlux / 20'000;
        EXPECT_NEAR(rounded.flux(), exact.flux(), ray);
        if (dual > 0) continue;  // views beside the disc are negative
        const auto flux_of = [](const LightField& field, int m, int n) {
            double sum = 0;
            for (int k = 0; k < field.rig().pixels.x; ++k)
                for (int l = 0; l < field.rig().pixels.y; ++l) sum += double{field.coefficient(m, n, k, l)};
            return sum * field.rig().cell_volume();
        };
        for (int m = 0; m < exact.rig().views.x; ++m)
            for (int n = 0; n < exact.rig().views.y; ++n)
                EXPECT_NEAR(flux_of(rounded, m, n), flux_of(exact, m, n), ray) << m << " " << n;
    }
}

// A field that is negative where the last views are still has no more light than its rays.
TEST(RoundToRays, LastCoefficientsNegative_AreMadeUpForByTheFirst) {
    Rig rig = rig_of(4, 4);
    std::vector<float> e(rig.coefficients(), 0.0F);
    const auto ray = static_cast<float>(kFlux / 100 / rig.cell_volume());
    for (std::size_t i = 0; i < 10; ++i) e[i] = 4 * ray, e[e.size() - 1 - i] = -ray;
    const LightField exact(rig, e);
    const LightField rounded = rounded_to_rays(exact, disc_rays(100));
    EXPECT_NEAR(rounded.flux(), exact.flux(), kFlux / 100);
    EXPECT_GE(*std::min_element(rounded.coefficients().begin(), rounded.coefficients().end()), 0);
}

// From contact to the far field the light changes by far less than its noise. Rounding to whole rays one by
// one, without making up for it, is rejected.
TEST(RoundToRays, LightOnPlanes_ChangesByATenthOfItsNoiseAtMost) {
    constexpr int kRays = 100'000;
    const RaySet set = disc_rays(kRays);
    const LightField exact = projected(set, rig_of(20, 16), {0, 1});
    const LightField rounded = rounded_to_rays(exact, set);
    const LightField singly = rounded_singly(exact, kFlux / kRays / exact.rig().cell_volume());
    for (const auto& [distance, half] :
         {std::pair(1e-6, 0.003), std::pair(0.001, 0.005), std::pair(0.01, 0.04), std::pair(1.0, 3.0)}) {
        // A patch of 32 x 32 pixels gets at most all rays.
        const double noise = std::sqrt(32.0 * 32.0 / kRays);
        EXPECT_LT(change_on(distance, half, exact, rounded), 0.1 * noise) << distance;
        EXPECT_GT(change_on(distance, half, exact, singly), 0.1 * noise) << distance;
    }
}

TEST(RoundToRays, File_IsAtMostAThirdAsLarge) {
    const RaySet set = disc_rays(100'000);
    const TemporaryFolder folder;
    const auto bytes = [&](const LightField& field) {
        write_light_field(folder / "field.exr", field);
        return std::filesystem::file_size(folder / "field.exr");
    };
    const LightField exact = projected(set, rig_of(27, 17), {0.5, 1});
    const auto before = bytes(exact), after = bytes(rounded_to_rays(exact, set));
    EXPECT_LE(3 * after, before);
    // The file holds the coefficients exactly.
    const LightField read = read_light_field(folder / "field.exr"), rounded = rounded_to_rays(exact, set);
    EXPECT_TRUE(std::equal(read.coefficients().begin(), read.coefficients().end(),
                           rounded.coefficients().begin(), rounded.coefficients().end()));
}

// A dim part of a lamp, of rays that carry a hundredth of the others' flux, is not lost between multiples of
// the bright ones.
TEST(RoundToRays, DimRaysBesideBrightOnes_SetTheMultiple) {
    RaySet set = disc_rays(10'000);
    const RaySet dim = disc_rays(40'000, 0.04 * kFlux);
    set.rays.insert(set.rays.end(), dim.rays.begin(), dim.rays.end());
    set.flux += dim.flux;
    const LightField exact = projected(set, rig_of(16, 12), {0, 1});
    const double dim_ray = dim.flux / 40'000 / exact.rig().cell_volume();
    EXPECT_LE(multiple_of(rounded_to_rays(exact, set)), dim_ray / 8 * std::sqrt(2.0));
}

// Colours between those of two kinds of rays stay between them, and the colour of all light is kept.
TEST(RoundToRays, ColouredField_KeepsItsColours) {
    RaySet set = disc_rays(20'000);
    for (std::size_t i = 0; i < set.rays.size(); ++i)
        set.tristimulus.emplace_back(i % 2 == 0 ? V3f(1.6F, 1, 0.1F) : V3f(0.4F, 1, 1.9F));
    const LightField exact = projected(set, rig_of(12, 10), {0, 0});
    ASSERT_TRUE(exact.coloured());
    const LightField rounded = rounded_to_rays(exact, set);
    EXPECT_NEAR(rounded.xyz().x, exact.xyz().x, 1e-3);
    EXPECT_NEAR(rounded.xyz().z, exact.xyz().z, 1e-3);
    EXPECT_NEAR(rounded.flux(), exact.flux(), 1e-3 * exact.flux());
    const LightField x = rounded.channel(0), y = rounded.channel(1);
    int bright = 0, odd = 0;
    const double ray = kFlux / 20'000 / exact.rig().cell_volume();
    for (std::size_t i = 0; i < y.coefficients().size(); ++i) {
        const auto of_x = double{x.coefficients()[i]}, of_y = double{y.coefficients()[i]};
        EXPECT_EQ(of_x == 0 && of_y == 0, rounded.coefficients()[i] == 0) << i;
        if (of_y < ray) continue;
        ++bright;
        odd += of_x < 0.35 * of_y || of_x > 1.7 * of_y;
    }
    ASSERT_GT(bright, 100);
    EXPECT_LT(odd, 0.01 * bright);
}

}  // namespace round_to_rays_test
}  // namespace lucerna
