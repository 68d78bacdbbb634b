// The stated error includes the blur of photon density estimates. The render itself measures it by the
// difference between its density estimates and sharper ones, in both halves of the samples.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "engine/base/stats.h"
#include "engine/image/image.h"
#include "engine/render/film.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace blur_test {

// Returns the hard shadows of a plate on a floor by two point lights, each of which lights the other's
// shadow.
Scene shadows() {
    testing::SceneMaker make;
    make.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, make.diffuse(Rgb(0.7F)));
    make.quad({-0.3F, 1, -0.3F}, {0, 0, 0.6F}, {0.6F, 0, 0}, make.diffuse(Rgb(0)));
    make.light(make_point_light({-0.8F, 2, 0}, Rgb(1)));
    make.light(make_point_light({0.8F, 2, 0}, Rgb(1)));
    return make.build();
}

constexpr int kSize = 48;

Job job_of(const IntegratorSettings& settings, int samples) {
    Job job = testing::make_job(shadows(), testing::camera({0.1F, 0.9F, 0}, {0.8F, 0, 0}, kSize, kSize, 70),
                                settings, samples);
    job.film.two_halves = true;
    job.film.adaptive = false;
    return job;
}

struct Case {
    const char* name;
    IntegratorSettings settings;
    int samples;
};
std::vector<Case> cases() {
    PhotonMapSettings nearest;
    nearest.photons = 20'000;
    nearest.direct = DirectMethod::map;
    nearest.indirect = IndirectMethod::none;
    nearest.estimate.k = 60;
    PhotonMapSettings fixed = nearest;
    fixed.estimate.k = 0;
    fixed.estimate.radius = 0.1F;
    fixed.photons = 100'000;
    ProgressiveSettings progressive;
    progressive.photons = 20'000;
    progressive.direct = DirectMethod::map;
    return {{"nearest photons", nearest, 8},
            {"a fixed radius", fixed, 8},
            {"progressive", progressive, 8 * progressive.samples}};
}

// With 8 pairs of renders the measured bias is known to about 5 %, and the mean of the stated values to about
// 15 %.
TEST(BlurOfPhotons, Long_OfAShadowsEdge_IsWhatIsStated) {
    const Job exact = job_of(PathSettings{}, 256);
    Monitor silent;
    RenderOptions options;
    options.workers = Workers{2};
    const Image reference = render(exact, options, silent).image;
    double mean = 0;
    for (int y = 0; y < kSize; ++y) {
        for (int x = 0; x < kSize; ++x) mean += luminance(reference.rgb_at(x, y)) / (kSize * kSize);
    }
    for (const Case& which : cases()) {
        const Job job = job_of(which.settings, which.samples);
        std::vector<Image> images;
        RunningStats stated;
        for (std::uint64_t seed = 1; seed <= 16; ++seed) {
            options.seed = seed;
            const RenderResult result = render(job, options, silent);
            ASSERT_TRUE(result.report.blur) << which.name;
            stated.add(sqr(*result.report.blur));
            images.push_back(result.image);
        }
        double square = 0;
        for (std::size_t i = 0; i + 1 < images.size(); i += 2) {
            for (int y = 0; y < kSize; ++y) {
                for (int x = 0; x < kSize; ++x) {
                    const double truth = double{luminance(reference.rgb_at(x, y))};
                    const double a = double{luminance(images[i].rgb_at(x, y))} - truth;
                    const double b = double{luminance(images[i + 1].rgb_at(x, y))} - truth;
                    square += a * b / error_scale2(truth, mean) / (8.0 * kSize * kSize);
                }
            }
        }
        const double measured = std::sqrt(square), said = std::sqrt(stated.mean());
        std::cout << which.name << ": measured " << measured << ", stated " << said << "\n";
        EXPECT_GT(measured, 0.02) << which.name << ": there is nothing to measure";
        EXPECT_GT(said / measured, 0.67) << which.name;
        EXPECT_LT(said / measured, 1.5) << which.name;
    }
}

// A path tracer has no blur.
TEST(BlurOfPhotons, WithoutDensityEstimates_IsNone) {
    Monitor silent;
    const RenderResult result = render(job_of(PathSettings{}, 8), {}, silent);
    EXPECT_EQ(result.report.blur, 0);
}

// Noise in the differences, as large as the light itself, must not count as blur; noise common to both
// halves, as of shared photons, would count.
TEST(BlurOfPhotons, NoiseOfDifferences_IsNoneUnlessHalvesShareIt) {
    constexpr int kSide = 64, kSamples = 8;
    const auto blur = [&](double mean, bool shared) {
        Film film(kSide, kSide, {1, false, true, false, true});
        Sampler sampler(5, Purpose::test, 0, 0);
        for (int y = 0; y < kSide; ++y) {
            for (int x = 0; x < kSide; ++x) {
                for (int s = 0; s < kSamples; ++s) {
                    const auto draw = [&] { return static_cast<float>(mean) + 2 * sampler.next() - 1; };
                    const float first = draw(), second = shared ? first : draw();
                    film.add(x, y, Rgb(0.9F + 0.2F * sampler.next()), 1, 0, first);
                    film.add(x, y, Rgb(0.9F + 0.2F * sampler.next()), 1, 1, second);
                }
            }
        }
        return film.error().blur;
    };
    const double times = std::sqrt(Film::kBlurOfDifference / 1.01);
    // A product of two such means of eight has a standard deviation of 1/24, the mean of 4096 of them
    // 0.00065.
    EXPECT_LT(blur(0, false), std::sqrt(4 * 0.00065) * times);
    EXPECT_NEAR(blur(0.2, false), 0.2 * times, 0.2 * times * 0.05);
    EXPECT_GT(blur(0, true), 0.19 * times) << "1/24 of shared noise";
}

}  // namespace blur_test
}  // namespace lucerna
