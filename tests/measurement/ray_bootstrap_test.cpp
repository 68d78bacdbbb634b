// Bootstrap replicates of a ray set must scatter as repeated measurements of the lamp would, and preserve the
// set's stated totals.
#include "lights/measurement/ray_bootstrap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/math/distributions/fisher_f.hpp>
#include <set>

#include "engine/base/sampler.h"
#include "engine/base/stats.h"
#include "engine/base/warp.h"
#include "lights/measurement/lumigraph_fit.h"
#include "lights/measurement/plane_irradiance.h"
#include "tests/support/error_of.h"
#include "tests/support/lamp_rays.h"
#include "tests/support/statistics.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace ray_bootstrap_test {

using testing::kFalseAlarm;
using testing::lambertian;

constexpr double kRadius = 0.01, kFlux = 100;

// Returns independent rays of a Lambertian disc with a total flux of kFlux, as measurement `number` of the
// same lamp. Every third ray carries twice the flux of the others.
RaySet disc_rays(int count, std::uint32_t number) {
    RaySet set;
    set.unit = FluxUnit::lumen;
    set.flux = set.header_lumens = kFlux;
    const double each = kFlux / (count + count / 3);  // count is a multiple of 3
    for (int i = 0; i < count; ++i) {
        Sampler sampler(7, Purpose::test, number, static_cast<std::uint64_t>(i));
        const V2d p = kRadius * V2d(square_to_disc(sampler.next2()));
        const V3d d = lambertian({0, 0, 1}, sampler.next2());
        set.rays.push_back({V3f(V3d(p.x, p.y, 0)), V3f(d), static_cast<float>(i % 3 == 0 ? 2 * each : each)});
    }
    return set;
}

Rig planes() {
    Rig rig;
    rig.views = {5, 5};
    rig.spacing = {kRadius, kRadius};
    rig.pixels = {20, 20};
    rig.distance = 0.05;
    rig.pixel = {0.016, 0.016};
    rig.basis = PixelBasis::hat;
    return rig;
}

// Returns the irradiance half a metre below the lamp.
double irradiance_under(const RaySet& set) {
    Monitor silent;
    return irradiance(project_rays(set, planes(), {}, silent, {0.5, 1}).field, {0.1, 0, 0.5});
}

bool same_rays(const RaySet& a, const RaySet& b) {
    return std::equal(
        a.rays.begin(), a.rays.end(), b.rays.begin(), b.rays.end(),
        [](const LampRay& x, const LampRay& y) { return x.o == y.o && x.d == y.d && x.flux == y.flux; });
}

// Tests by Fisher's F whether two variance estimates with the given degrees of freedom agree.
bool one_variance(double a, double freedom_a, double b, double freedom_b) {
    const boost::math::fisher_f f(freedom_a, freedom_b);
    const double upper = cdf(complement(f, a / b));
    return std::min(upper, 1 - upper) > kFalseAlarm / 2;
}

// Returns the variance between replicates, from `sets` measurements with `count` replicates each.
template <typename Resample>
double bootstrap_variance(int sets, int count, int rays, Resample&& resample) {
    double sum = 0;
    for (int s = 0; s < sets; ++s) {
        const RaySet measured = disc_rays(rays, 10000 + static_cast<std::uint32_t>(s));
        RunningStats values;
        for (int b = 1; b <= count; ++b) values.add(irradiance_under(resample(measured, s, b)));
        sum += values.variance() / sets;
    }
    return sum;
}

TEST(RayBootstrap, Scatter_IsThatOfRepeatedMeasurements) {
    constexpr int kRays = 300, kMeasurements = 300, kSets = 20, kReplicates = 20;
    RunningStats measured;
    for (std::uint32_t m = 0; m < kMeasurements; ++m) measured.add(irradiance_under(disc_rays(kRays, m)));
    // The irradiance of a Lambertian disc at 0.5 m, 0.1 m off its axis: I cos⁴γ / h².
    const double expected = kFlux / M_PI / sqr(0.5) / sqr(1 + sqr(0.1 / 0.5));
    EXPECT_NEAR(measured.mean() / expected, 1, 0.05);  // the planes smooth the light
    const auto as_measured = [&](auto&& resample) {
        return one_variance(bootstrap_variance(kSets, kReplicates, kRays, resample),
                            kSets * (kReplicates - 1), measured.variance(), kMeasurements - 1);
    };
    const auto key = [](int set, int b) { return BootstrapKey{static_cast<std::uint64_t>(set), b, 0}; };
    EXPECT_TRUE(as_measured([&](const RaySet& set, int s, int b) { return resampled(set, key(s, b), {}); }));
    // The test must reject drawing half of the rays, and drawing each ray alternately once and twice.
    EXPECT_FALSE(as_measured([&](const RaySet& set, int s, int b) {
        RaySet half = resampled(set, key(s, b), {});
        half.rays.resize(half.rays.size() / 2);
        for (LampRay& ray : half.rays) ray.flux *= 2;
        return half;
    }));
    EXPECT_FALSE(as_measured([&](const RaySet& set, int s, int b) {
        RaySet halved = resampled(set, key(s, b), {});
        std::copy_n(set.rays.begin(), halved.rays.size() / 2, halved.rays.begin());
        return halved;
    }));
}

TEST(RayBootstrap, Draws_AreTheSameByOneKeyAndOthersByAnother) {
    const RaySet set = disc_rays(60000, 0);  // several chunks
    const RaySet drawn = resampled(set, {1, 1, 0}, {});
    EXPECT_TRUE(same_rays(drawn, resampled(set, {1, 1, 0}, Workers{3})));
    for (const BootstrapKey& other : {BootstrapKey{2, 1, 0}, BootstrapKey{1, 2, 0}, BootstrapKey{1, 1, 1}})
        EXPECT_FALSE(same_rays(drawn, resampled(set, other, {})));
    // Rays are drawn with replacement: a share 1 - 1/e of them is drawn at all, with a variance of (1/e -
    // 2/e²) / n, and each is stored only once.
    std::set<float> places;
    for (const LampRay& ray : drawn.rays) places.insert(ray.o.x);
    const double share = static_cast<double>(drawn.rays.size()) / 60000;
    EXPECT_NEAR(share, 1 - std::exp(-1), 4 * std::sqrt((std::exp(-1) - 2 * std::exp(-2)) / 60000));
    EXPECT_GT(static_cast<double>(places.size()), 0.998 * static_cast<double>(drawn.rays.size()));
}

TEST(RayBootstrap, Flux_IsWhatTheFileStatesOrWhatTheRaysHave) {
    RaySet set = disc_rays(600, 0);
    set.skipped_flux = 7, set.flux += 7, set.header_lumens += 7;
    const auto sum = [](const RaySet& of) {
        double flux = of.skipped_flux;
        for (std::size_t i = 0; i < of.rays.size(); ++i) flux += of.light_of(i);
        return flux;
    };
    const RaySet stated = resampled(set, {0, 1, 0}, {});
    EXPECT_EQ(stated.flux, set.flux);
    EXPECT_NEAR(sum(stated), set.flux, 1e-5 * set.flux);
    set.header_lumens = 0;
    const RaySet counted = resampled(set, {0, 1, 0}, {});
    EXPECT_NE(counted.flux, set.flux);
    EXPECT_NEAR(counted.flux, set.flux, 0.05 * set.flux);
    EXPECT_NEAR(sum(counted), counted.flux, 1e-5 * set.flux);
    // A flux in watts is not scaled to the header's lumens.
    set.unit = FluxUnit::watt;
    set.header_lumens = 107;
    EXPECT_NE(resampled(set, {0, 1, 0}, {}).flux, set.flux);
    // In coloured rays the mean Y stays 1 relative to the mean of all.
    for (std::size_t i = 0; i < set.rays.size(); ++i)
        set.tristimulus.push_back(i % 2 == 0 ? V3f(0.5F, 1.5F, 0.1F) : V3f(1, 0.5F, 2));
    set.header_watts = set.flux;
    const RaySet coloured = resampled(set, {0, 1, 0}, {});
    double light = 0, flux = 0;
    for (std::size_t i = 0; i < coloured.rays.size(); ++i)
        light += coloured.light_of(i), flux += double{coloured.rays[i].flux};
    EXPECT_NEAR(light / flux, 1, 1e-5);
    EXPECT_NEAR(coloured.xyz.y, 1, 1e-6);
}

TEST(RayBootstrap, Replicates_AreCountedIfTheyAreOfTheLamp) {
    const testing::TemporaryFolder folder;
    const auto lamp = folder.path() / "a.lamp.exr";
    EXPECT_EQ(replicate_file(lamp, 3).filename(), "a.lamp-replicate-03.exr");
    EXPECT_EQ(replicate_file("lamp.exr", 123), "lamp-replicate-123.exr");
    const auto field = [](float value, std::uint64_t replicate_of) {
        LightFieldInfo info;
        info.replicate_of = replicate_of;
        return LightField(planes(), std::vector<float>(planes().coefficients(), value), info);
    };
    write_light_field(lamp, field(1, 0));
    EXPECT_EQ(count_replicates(lamp), 0);
    const std::uint64_t hash = content_hash(read_light_field(lamp));
    for (const int b : {1, 2, 4}) write_light_field(replicate_file(lamp, b), field(2, hash));
    EXPECT_EQ(read_light_field(replicate_file(lamp, 1)).info().replicate_of, hash);
    EXPECT_EQ(count_replicates(lamp), 2);
    write_light_field(replicate_file(lamp, 2), field(2, hash + 1));
    EXPECT_THAT(testing::error_of([&] { count_replicates(lamp); }),
                ::testing::HasSubstr("a.lamp-replicate-02.exr"));
}

}  // namespace ray_bootstrap_test
}  // namespace lucerna
