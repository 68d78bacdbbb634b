// Tests how many gather rays and light samples are spent per camera sample.
#include "engine/integrators/splitting.h"

#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace splitting_test {

// Returns the numbers for camera samples of mean 1, with variance `own`, plus gathered and direct light of
// mean 1 each with the given variances.
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
    // Averages over cells that share no samples.
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

// The number of gather rays grows with the root of their variance, and falls with the variance of the camera
// samples. Pixel weights come from few samples, and a difference of variances is noisy; hence the wide
// tolerance, which still excludes ratios of 1 and 3.
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

// Returns the plan for camera samples that meet `places` places at full share and as many at a tenth, each
// with gathered light of mean 1 and variance 2.
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

// At a tenth of the share ten times fewer gather rays are shot, by the root of the variance of 2; below one
// ray per sample the second moment, 3, replaces the variance.
TEST(Splitting, FaintPlaces_GetFewerGatherRays) {
    const SplitPlan found = plan(1);
    ASSERT_EQ(share_class(0.1F), kShareClasses - 1);
    EXPECT_NEAR(found.front().gather_rays / found.back().gather_rays, 10 * std::sqrt(2.0 / 3), 1.5);
    EXPECT_GT(found.front().gather_rays, 1);
    EXPECT_LT(found.back().gather_rays, 1);
}

// One direction in a hundred brings 100, all others nothing. Guiding draws the bright ones `ratio` times as
// often, with a weight of 1/ratio.
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

// Where guiding is not chosen, the moments are those of unguided rays.
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

// Numbers that differ between places, and chances below 1, change no mean: two comparisons, false alarms as
// for expect_agrees().
TEST(Splitting, Long_OfAPhotonMapImage_ChangesNoMean) {
    testing::expect_agrees(means(0, 32), means(8, 16), "split", 0.01);
}

// Renders the same seed with 1 and 3 threads.
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
