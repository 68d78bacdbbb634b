// How many samples of each kind a camera sample is worth.
#include "engine/integrators/splitting.h"

#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace splitting_test {

// A film whose camera samples see 1, and gathered light of the given variance about 1 more.
SplitNumbers numbers(double gathered, double own, double direct = 0) {
    const Camera camera = testing::small_cornell_camera(64);
    const View view{&camera, V2f(0, 0), V2f(64, 64)};
    const Splitting splitting(view, 3, 0, Workers{2}, [&](const Ray&, Sampler& sampler, SplitPilot& pilot) {
        const auto draw = [&](double variance) {
            return std::sqrt(3 * variance) * (2 * double{sampler.next()} - 1);
        };
        const auto twice = [&](SplitMoments& kind, double variance) {
            const double a = 1 + draw(variance), b = 1 + draw(variance);
            kind.add(a, b);
            return 0.5 * (a + b);
        };
        const double value = 1 + draw(own) + twice(pilot[0].gather, gathered) + twice(pilot[0].light, direct);
        return Rgb(static_cast<float>(value));
    });
    // Over cells that have no samples in common.
    SplitNumbers mean{0, 0, 0};
    constexpr int kSide = 5;
    for (int i = 0; i < kSide * kSide; ++i) {
        const V2f at(static_cast<float>(6 + 12 * (i % kSide)), static_cast<float>(6 + 12 * (i / kSide)));
        const SplitNumbers& own_numbers = splitting.at(at)[0];
        mean.light_samples += own_numbers.light_samples / (kSide * kSide);
        mean.gather_rays += own_numbers.gather_rays / (kSide * kSide);
    }
    return mean;
}

// By the root of their variance, and less the more the camera samples themselves vary. What pixels weigh goes
// by what few samples saw of them, and a difference of variances is noisy: neither 1 nor 3 is that near.
TEST(Splitting, GatherRays_GoByTheRootOfTheirVariance) {
    const double few{numbers(2, 2).gather_rays}, more{numbers(6, 2).gather_rays};
    EXPECT_NEAR(more / few, std::sqrt(3.0), 0.5);
    const double edges{numbers(6, 6).gather_rays};
    EXPECT_NEAR(more / edges, std::sqrt(3.0), 0.5);
    EXPECT_GT(few, 1);
}

TEST(Splitting, LightSamples_AreOneUnlessTheyAreTheNoise) {
    EXPECT_NEAR(numbers(0.1, 0.5, 0.01).light_samples, 1, 1e-5);
    EXPECT_GT(numbers(0.01, 0.05, 4).light_samples, 2);
}

// Each of `places` gives 1 and gathered light of variance 2, once at full share and once at a tenth.
SplitPlan plan(int places) {
    const Camera camera = testing::small_cornell_camera(64);
    const View view{&camera, V2f(0, 0), V2f(64, 64)};
    const Splitting splitting(view, 3, 0, Workers{2}, [&](const Ray&, Sampler& sampler, SplitPilot& pilot) {
        double sum = 1;
        for (const double share : {1.0, 0.1}) {
            SplitMoments& kind = pilot[share_class(static_cast<float>(share))].gather;
            const auto draw = [&] { return share * (1 + std::sqrt(6.0) * (2 * double{sampler.next()} - 1)); };
            for (int i = 0; i < places; ++i) {
                const double a = draw(), b = draw();
                kind.add(a, b);
                sum += 0.5 * (a + b) / places;
            }
        }
        return Rgb(static_cast<float>(sum + 0.5 * (2 * double{sampler.next()} - 1)));
    });
    return splitting.at({32, 32});
}

// Ten times less of a place's light reaches the pixel: ten times fewer gather rays, by the root of the
// variance of 2; below one ray it is that of the second moment, 3.
TEST(Splitting, FaintPlaces_GetFewerGatherRays) {
    const SplitPlan found = plan(1);
    ASSERT_EQ(share_class(0.1F), kShareClasses - 1);
    EXPECT_NEAR(found.front().gather_rays / found.back().gather_rays, 10 * std::sqrt(2.0 / 3), 1.5);
    EXPECT_GT(found.front().gather_rays, 1);
    EXPECT_LT(found.back().gather_rays, 1);
}

// Two kinds of directions: one in a hundred brings 100, all others nothing; guiding draws those that do
// `ratio` times as often, and they count so much less.
SplitNumbers numbers_guided(double ratio) {
    const Camera camera = testing::small_cornell_camera(64);
    const View view{&camera, V2f(0, 0), V2f(64, 64)};
    const Splitting splitting(view, 3, 0, Workers{2}, [&](const Ray&, Sampler& sampler, SplitPilot& pilot) {
        const double chance = 0.01 * ratio, otherwise = (1 - chance) / 0.99;
        const auto draw = [&] { return double{sampler.next()} < chance; };
        const bool a = draw(), b = draw();
        const double bright = 100 / ratio;
        pilot[0].gather.add(a ? bright : 0, b ? bright : 0, a ? ratio : otherwise, b ? ratio : otherwise);
        return Rgb(static_cast<float>(1 + 0.5 * ((a ? bright : 0) + (b ? bright : 0))));
    });
    return splitting.at({32, 32})[0];
}

TEST(Splitting, Guiding_IsChosenWhereItLowersTheVariance) {
    EXPECT_TRUE(numbers_guided(10).guided);
    EXPECT_FALSE(numbers_guided(1).guided) << "it does nothing";
    EXPECT_FALSE(numbers_guided(0.5).guided) << "it looks away from the light";
}

// Where it is not chosen the numbers are those of rays that are not guided.
TEST(Splitting, GuidingThatDoesNotPay_LeavesTheVarianceWithoutIt) {
    SplitMoments moments;
    moments.add(4, 0, 0.5, 0.5);
    EXPECT_DOUBLE_EQ(moments.variance, 8);
    EXPECT_DOUBLE_EQ(moments.unguided_variance(), 4) << "E x² is 4 in place of 8, and the mean² 0";
    EXPECT_FALSE(moments.choose_guiding());
    EXPECT_DOUBLE_EQ(moments.variance, 4);
    EXPECT_DOUBLE_EQ(moments.second_moment, 4);
}

TEST(Splitting, Pilot_IsTheSameForAnyNumberOfThreads) {
    const Camera camera = testing::small_cornell_camera(40);
    const View view{&camera, V2f(0, 0), V2f(40, 40)};
    const auto sample = [](const Ray&, Sampler& sampler, SplitPilot& pilot) {
        pilot[0].gather.add(double{sampler.next()}, double{sampler.next()});
        return Rgb(sampler.next());
    };
    const Splitting one(view, 3, 0, Workers{1}, sample), three(view, 3, 0, Workers{3}, sample);
    ASSERT_GT(one.cells(), 16U);
    for (int y = 0; y < 40; y += 4) {
        for (int x = 0; x < 40; x += 4) {
            const V2f at(static_cast<float>(x), static_cast<float>(y));
            EXPECT_EQ(one.at(at)[0].gather_rays, three.at(at)[0].gather_rays);
        }
    }
}

Scene room_with_glass() {
    return testing::small_cornell_with([](testing::SceneMaker& make) {
        make.sphere({0.28F, 0.22F, 0.3F}, 0.2F, make.material(DielectricMaterial{}));
    });
}
testing::RegionMeans means(int gather_rays, int spp) {
    PhotonMapSettings settings;
    settings.photons = 50'000;
    settings.gather_rays = gather_rays;
    const Job job = testing::make_job(room_with_glass(), testing::small_cornell_camera(24), settings, spp);
    return testing::region_means(job, 6, testing::all_but_the_lamp,
                                 [](double, double y) { return y < -0.6; });
}

// Numbers that differ from place to place, and chances below 1, change no mean: 4 sigmas, 2 comparisons.
TEST(Splitting, Long_OfAPhotonMapImage_ChangesNoMean) {
    testing::expect_agrees(means(0, 32), means(8, 16), "split", 0.01);
}

// The same seed, the same image, on any number of threads.
TEST(Splitting, OfAPhotonMapImage_IsTheSameForAnyNumberOfThreads) {
    Monitor silent;
    PhotonMapSettings settings;
    settings.photons = 20'000;
    const Job job = testing::make_job(room_with_glass(), testing::small_cornell_camera(24), settings, 2);
    EXPECT_EQ(render(job, {3, Workers{1}}, silent).image.data,
              render(job, {3, Workers{3}}, silent).image.data);
}

}  // namespace splitting_test
}  // namespace lucerna
