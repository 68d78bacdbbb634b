// The halves of the samples are independent, and together they are the image.
#include <gtest/gtest.h>

#include "engine/base/stats.h"
#include "engine/render/film.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace halves_test {

TEST(Halves, TogetherAreTheFilmOfAllSamples) {
    for (const float weight : {1.0F, 1.5F}) {
        for (const bool by_pass : {false, true}) {
            Film whole(1, 1, {weight, by_pass, false}), halves(1, 1, {weight, by_pass, true});
            Sampler sampler(21, Purpose::test, 0, 0);
            for (int s = 0; s < 50; ++s) {
                std::vector<Film::Sample> pass;
                for (int i = 0; i < (by_pass ? 3 : 1); ++i) {
                    const bool negative = weight > 1 && sampler.next() < 1.0F / 6;
                    pass.push_back({Rgb(100 + sampler.next()), negative ? -weight : weight});
                }
                if (by_pass) {
                    whole.add_pass(0, 0, pass);
                    halves.add_pass(0, 0, pass, s % 2);
                } else {
                    whole.add(0, 0, pass[0].radiance, pass[0].weight);
                    halves.add(0, 0, pass[0].radiance, pass[0].weight, s % 2);
                }
            }
            const Image a = whole.develop(2), b = halves.develop(2);
            EXPECT_NEAR(a.value(0, 0, 0), b.value(0, 0, 0), 1e-3);
            // A pass is compared with the current mean of its half, which depends on the half; with unequal
            // weights the variances therefore differ.
            EXPECT_NEAR(a.value(0, 0, 3), b.value(0, 0, 3),
                        (by_pass && weight > 1 ? 0.1F : 1e-3F) * a.value(0, 0, 3));
            const Image first = halves.develop_half(0, 2), second = halves.develop_half(1, 2);
            EXPECT_EQ(first.value(0, 0, kSamples), by_pass ? 75 : 25);
            // With unequal weights the mean combines the halves' means and weights, so it is not their
            // average.
            if (weight > 1) continue;
            EXPECT_NEAR(0.5F * (first.value(0, 0, 0) + second.value(0, 0, 0)), b.value(0, 0, 0), 1e-3);
        }
    }
}

// The halves must differ by the image's noise only: none of it is common to both, and none is subtracted
// twice.
TEST(Halves, Long_OfAPathTracersImage_DoNotDependOnEachOther) {
    constexpr int kSize = 48, kSamples = 8, kReference = 2048;
    const auto image = [](int samples, bool halves) {
        Job job = testing::make_job(testing::integrating_sphere(0.5F, 1),
                                    testing::camera({0, 0, 0}, {0.5F, 0, 1}, kSize, kSize, 60),
                                    PathSettings{}, samples);
        job.film.two_halves = halves;
        Monitor quiet;
        RenderOptions options;
        options.seed = 3;
        return render(job, options, quiet);
    };
    const Image reference = image(kReference, false).image;
    const auto correlation = [&](const Image& a, const Image& b) {
        double of_both = 0, of_a = 0, of_b = 0;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                const double truth = double{reference.value(x, y, 1)};
                const double d_a = double{a.value(x, y, 1)} - truth, d_b = double{b.value(x, y, 1)} - truth;
                of_both += d_a * d_b, of_a += d_a * d_a, of_b += d_b * d_b;
            }
        }
        return of_both / std::sqrt(of_a * of_b);
    };
    const RenderResult result = image(kSamples, true);
    ASSERT_TRUE(result.denoiser_input);
    const auto& halves = result.denoiser_input->halves;
    // Independent halves have a correlation of 0 ± 1/48; the tolerance is four sigmas.
    EXPECT_LT(std::fabs(correlation(halves[0], halves[1])), 4.0 / kSize);
    // The same half given twice is fully correlated.
    EXPECT_GT(correlation(halves[0], halves[0]), 0.99);
}

}  // namespace halves_test
}  // namespace lucerna
