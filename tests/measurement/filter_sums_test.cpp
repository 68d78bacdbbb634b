// Rays projected through the two opacities give the same field as their direct projection, with the predicted
// noise.
#include "lights/measurement/ray_projection.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/base/error.h"
#include "engine/base/warp.h"
#include "lights/bell.h"
#include "tests/lights/field_fixtures.h"

namespace lucerna {
namespace filter_sums_test {

Rig bench(bool travels) {
    Rig rig;
    rig.views = {6, 5};
    rig.spacing = {0.004, 0.006};
    rig.pixels = travels ? V2i(9, 13) : V2i(9, 7);  // a travelling sensor sees all that its filter transmits
    rig.pixel = travels ? V2d(0.004 / 2, 0.006 / 3) : V2d(0.02, 0.03);
    rig.distance = travels ? 0.02 : 0.1;
    rig.shift = travels ? V2i(2, 3) : V2i(0, 0);
    rig.centre = {0.002, -0.001, 0.003};
    return rig;
}

// Returns rays of unequal flux from a square of 3 cm, a few of them backward.
std::vector<LampRay> some_rays(int count, std::uint64_t seed) {
    std::vector<LampRay> rays;
    for (int i = 0; i < count; ++i) {
        Sampler sampler(seed, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const V2f at = sampler.next2();
        V3f d = square_to_cosine_hemisphere(sampler.next2());
        if (sampler.next() < 0.05F) d.z = -d.z;
        rays.push_back({{0.03F * (at.x - 0.5F), 0.03F * (at.y - 0.5F), 0.001F}, d, 0.5F + sampler.next()});
    }
    return rays;
}

FilterSums sums_of(const Rig& rig, std::span<const LampRay> rays, int threads = 2) {
    FilterSums sums(rig);
    add_rays(sums, rays, Workers{threads});
    return sums;
}

class FilterSumsOf : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(BothSetups, FilterSumsOf, ::testing::Values(false, true),
                         [](const auto& setup) { return setup.param ? "SetupA" : "SetupB"; });

TEST_P(FilterSumsOf, Rays_SubtractedAreTheirProjection) {
    const Rig rig = bench(GetParam());
    RaySet set;
    set.rays = some_rays(40'000, 11);
    for (const LampRay& ray : set.rays) set.flux += double{ray.flux};
    Monitor silent;
    const Projection direct = project_rays(set, rig, Workers{2}, silent);
    const FilterSums sums = sums_of(rig, set.rays);
    FilterImages images = images_of(sums, 1, {});
    images.flux = set.flux;
    const LightField field = field_of(images);
    double peak = 0;
    for (const float e : direct.field.coefficients()) peak = std::max(peak, std::fabs(double{e}));
    for (std::size_t i = 0; i < field.coefficients().size(); ++i) {
        EXPECT_NEAR(field.coefficients()[i], direct.field.coefficients()[i], 1e-6 * peak);
    }
    EXPECT_NEAR(field.info().missed, direct.account.missed(), 1e-5 * set.flux);
    EXPECT_NEAR(sums.account.backward, direct.account.backward, 1e-9 * set.flux);
    EXPECT_NEAR(sums.account.beside_s, direct.account.beside_s, 1e-9 * set.flux);
    EXPECT_NEAR(sums.account.beside_m, direct.account.beside_m, 1e-9 * set.flux);
    EXPECT_NEAR(sums.account.not_in_basis, direct.account.not_in_basis, 1e-9 * set.flux);
    EXPECT_GT(sums.account.backward, 0);
    EXPECT_GT(sums.account.beside_s, 0);
    EXPECT_GT(sums.account.beside_m, 0);
}

TEST_P(FilterSumsOf, OneRay_LeavesItsFluxTimesTheFilmsOpacity) {
    const Rig rig = bench(GetParam());
    // A ray passes S at a right angle, so for every filter it meets the pixel under that point.
    const V2d on_s(0.0007, -0.0021);
    const LampRay ray{V3f(V3d(on_s.x, on_s.y, 0) + rig.centre), {0, 0, 1}, 2.5F};
    const FilterImages images = images_of(sums_of(rig, std::span(&ray, 1)), 1, {});
    int lit = 0;
    for (int m = 0; m < rig.views.x; ++m) {
        for (int n = 0; n < rig.views.y; ++n) {
            const V2d from(on_s.x - rig.filter(0, m), on_s.y - rig.filter(1, n));
            for (const FilterSign sign : kFilterSigns) {
                double sum = 0;
                for (int k = 0; k < rig.pixels.x; ++k) {
                    for (int l = 0; l < rig.pixels.y; ++l)
                        sum += double{images.of(sign)[rig.index(m, n, k, l)]};
                }
                const double film = filter_opacity(rig, sign, from);
                EXPECT_NEAR(sum, 2.5 * film / (rig.pixel.x * rig.pixel.y),
                            1e-4 / (rig.pixel.x * rig.pixel.y));
                lit += film > 0;
            }
        }
    }
    EXPECT_EQ(lit, 16);  // the filters whose support contains the point
}

TEST(FilterSums, InBlocksAndOnAnyThreads_AreTheSame) {
    const Rig rig = bench(false);
    const std::vector<LampRay> rays = some_rays(60'000, 12);
    const FilterSums once = sums_of(rig, rays, 1);
    for (const int threads : {2, 3}) {
        const FilterSums again = sums_of(rig, rays, threads);
        EXPECT_EQ(once.positive, again.positive);
        EXPECT_EQ(once.negative, again.negative);
        EXPECT_EQ(once.squares, again.squares);
        EXPECT_EQ(once.account.beside_m, again.account.beside_m);
    }
    FilterSums blocks(rig);
    add_rays(blocks, std::span(rays).first(25'000), Workers{2});
    add_rays(blocks, std::span(rays).subspan(25'000), Workers{2});
    double worst = 0;
    for (std::size_t i = 0; i < once.positive.size(); ++i) {
        worst = std::max(worst, std::fabs(once.positive[i] - blocks.positive[i]));
    }
    EXPECT_LT(worst, 1e-10);  // only the order of summation differs
}

TEST(FilterSums, NoiseOfTwoHalves_IsTheNoisePredicted) {
    const Rig rig = bench(false);
    const FilterSums a = sums_of(rig, some_rays(200'000, 13));
    const FilterSums b = sums_of(rig, some_rays(200'000, 14));
    const LightField field_a = field_of(images_of(a, 1, {}));
    const LightField field_b = field_of(images_of(b, 1, {}));
    double difference2 = 0;
    double power = 0;
    for (std::size_t i = 0; i < field_a.coefficients().size(); ++i) {
        difference2 += sqr(double{field_a.coefficients()[i]} - double{field_b.coefficients()[i]});
        power += double{field_a.coefficients()[i]} *
                 double{field_b.coefficients()[i]};  // the two halves' noise is independent
    }
    const double count = static_cast<double>(rig.coefficients());
    const SamplingNoise noise = sampling_noise(a, 1, field_a);
    EXPECT_NEAR(noise.rms / std::sqrt(difference2 / 2 / count), 1, 0.05);
    EXPECT_NEAR(noise.relative / std::sqrt(difference2 / 2 / power), 1, 0.05);
    EXPECT_LT(noise.relative, 0.3);
}

TEST(FilterSums, OfNoGeometry_AreRefused) {
    Rig rig = bench(false);
    rig.pixels.x = 0;
    EXPECT_THROW(FilterSums{rig}, InputError);
}

}  // namespace filter_sums_test
}  // namespace lucerna
