// An image first, whatever the time: renders with a limit of time, from the first image to the last.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "engine/base/deadline_monitor.h"
#include "engine/base/monitor.h"
#include "engine/render/finishing.h"
#include "engine/render/method_choice.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace budget_test {

constexpr double kLong = 1000;  // seconds, more than any of these renders takes

Job small_job(const IntegratorSettings& settings, int spp) {
    const Camera camera = testing::camera({0.5F, 0.4F, -0.6F}, {0.5F, 0.2F, 1}, 33, 30, 30);
    Job job = testing::make_job(testing::small_cornell(), camera, settings, spp);
    job.film.two_halves = job.film.adaptive = true;
    return job;
}

// Every sample sees light: from within a sphere that shines and reflects.
Job bright_job(const IntegratorSettings& settings) {
    Job job = testing::make_job(testing::integrating_sphere(0.5, 1),
                                testing::camera({0, 0, 0}, {0, 0, 1}, 33, 30, 60), settings, kNoEndOfSamples);
    job.film.two_halves = job.film.adaptive = true;
    return job;
}

class WarningMonitor final : public Monitor {
  public:
    void warn(std::string_view line) override { lines.emplace_back(line); }
    std::vector<std::string> lines;
};

void expect_light_everywhere(const Image& image, const std::string& what) {
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x)
            EXPECT_GT(luminance(image.rgb_at(x, y)), 0) << what << ' ' << x << ' ' << y;
    }
}

void wait_until(const Stopwatch& clock, double seconds) {
    while (clock.seconds() < seconds) continue;
}

// The time is over before the first sample: the first step is rendered nevertheless.
TEST(Budget, NoTimeAtAll_ImageIsWholeAndTheProgramSaysThatItIsUpsampled) {
    ProgressiveSettings progressive;
    progressive.samples = 1;
    progressive.photons = 2000;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(progressive)}) {
        for (const bool two_halves : {true, false}) {
            Job job = bright_job(settings);
            job.film.two_halves = job.film.adaptive = two_halves;
            RenderOptions options{1, Workers{2}};
            options.limits.seconds = 1e-9;
            WarningMonitor monitor;
            const RenderResult result = render(job, options, monitor);
            EXPECT_TRUE(result.report.complete);
            EXPECT_EQ(result.report.samples_done, 0);
            EXPECT_EQ(result.report.whole_after, 0);
            expect_light_everywhere(result.image, "image");
            EXPECT_EQ(result.denoised.has_value(), two_halves);
            if (result.denoised) expect_light_everywhere(*result.denoised, "denoised");
            ASSERT_EQ(monitor.lines.size(), 2U);
            EXPECT_EQ(monitor.lines[0].find("the requested time is too short for an image of this size"), 0U);
            EXPECT_EQ(
                monitor.lines[1],
                "there was not enough time for one sample per pixel: the image is rendered at a quarter "
                "of its resolution and upsampled");
        }
    }
}

// The first image counts, whichever method follows it.
TEST(Budget, TimeOfTheFirstWholeImage_IsBeforeTheChoice) {
    for (const bool other : {false, true}) {
        Job job = bright_job(PathSettings{});
        RenderOptions options{1, Workers{2}};
        options.limits.seconds = 2;
        Monitor silent;
        const Stopwatch clock;
        double chosen_after = 0;
        const RenderResult result = render_choosing(job, options, silent, [&](const ChoiceLimits&) -> double {
            chosen_after = clock.seconds();
            if (other) job.integrator = PhotonMapSettings{};
            return 0;
        });
        EXPECT_GT(result.report.whole_after, 0);
        EXPECT_LT(result.report.whole_after, chosen_after);
    }
}

// The halves of a single sample are those of every second pixel.
TEST(Budget, OneSample_IsDenoised) {
    Job job = bright_job(PathSettings{});
    job.spp = 1;
    job.film.two_halves = true;
    Monitor silent;
    const RenderResult result = render(job, {1, Workers{2}}, silent);
    ASSERT_TRUE(result.denoised);
    expect_light_everywhere(*result.denoised, "denoised");
    EXPECT_NE(result.denoised->data[0], result.image.data[0]);
    EXPECT_FALSE(result.report.denoised_error);
}

TEST(Budget, NoTimeToChoose_SimplestMethodRendersTheImage) {
    Job job = bright_job(PhotonMapSettings{});
    RenderOptions options{1, Workers{2}};
    options.limits.seconds = 1e-9;
    Monitor silent;
    const RenderResult result = render_choosing(job, options, silent, [](const ChoiceLimits&) -> double {
        ADD_FAILURE() << "there is no first image to choose after";
        return 0;
    });
    EXPECT_TRUE(std::holds_alternative<PathSettings>(job.integrator));
    expect_light_everywhere(result.image, "image");
}

// Samples of the first image are the first samples of the rest: the image has the bits of an ordinary render.
TEST(Budget, ChosenMethodIsTheFirst_SameImageBitForBit) {
    constexpr int kSamples = 19;  // with decisions of the allocation at 8 and 16
    Monitor silent;
    const RenderResult plain = render(small_job(PathSettings{}, kSamples), {1, Workers{2}}, silent);
    Job job = small_job(PathSettings{}, kSamples);
    RenderOptions options{1, Workers{2}};
    options.limits.seconds = kLong;
    int chosen = 0;
    const RenderResult result = render_choosing(job, options, silent, [&](const ChoiceLimits& limits) {
        ++chosen;
        EXPECT_GT(limits.head_start, 0);
        EXPECT_LT(limits.limits.seconds, kLong);
        return limits.limits.error;
    });
    EXPECT_EQ(chosen, 1);
    EXPECT_EQ(result.report.samples_done, kSamples);
    EXPECT_EQ(result.image.data, plain.image.data);
    ASSERT_TRUE(result.denoised && plain.denoised);
    EXPECT_EQ(result.denoised->data, plain.denoised->data);
}

TEST(Budget, ChosenMethodHasTime_ImageIsIts) {
    ProgressiveSettings progressive;
    progressive.samples = 1;
    progressive.photons = 2000;
    Monitor silent;
    const RenderResult plain = render(small_job(progressive, 6), {1, Workers{2}}, silent);
    Job job = small_job(PathSettings{}, 6);
    RenderOptions options{1, Workers{2}};
    options.limits.seconds = kLong;
    const RenderResult result = render_choosing(job, options, silent, [&](const ChoiceLimits& limits) {
        job.integrator = progressive;
        return limits.limits.error;
    });
    EXPECT_EQ(result.image.data, plain.image.data);
    EXPECT_EQ(result.report.passes_done, 6);
}

TEST(Budget, ChosenMethodHasNoTime_FirstImageStays) {
    constexpr double kSeconds = 2;
    Monitor silent;
    Job job = bright_job(PathSettings{});
    RenderOptions options{1, Workers{2}};
    options.limits.seconds = kSeconds;
    const Stopwatch clock;
    const RenderResult result = render_choosing(job, options, silent, [&](const ChoiceLimits& limits) {
        wait_until(clock, kSeconds);
        job.integrator = ProgressiveSettings{};
        return limits.limits.error;
    });
    EXPECT_TRUE(std::holds_alternative<PathSettings>(job.integrator));
    EXPECT_TRUE(result.report.complete);
    expect_light_everywhere(result.image, "image");
}

TEST(Budget, FirstImageTookMostOfTheTime_NoOtherMethodIsChosen) {
    Monitor silent;
    const Limits limits{1, 0};
    const Job job = small_job(ProgressiveSettings{}, kNoEndOfSamples);
    const auto after_it = choose_method(job, limits, 3, Workers{2}, silent, 0.5);
    ASSERT_TRUE(after_it);
    EXPECT_TRUE(std::holds_alternative<PathSettings>(after_it->settings));
    const auto without = choose_method(job, limits, 3, Workers{2}, silent);
    ASSERT_TRUE(without);
    EXPECT_TRUE(std::holds_alternative<ProgressiveSettings>(without->settings));
}

// Memory that a large image uses for the first time.
constexpr double kFirstUse = 1.25;

TEST(Finishing, Plan_KeepsToItsShares) {
    // 1e6 pixels in 10 s: features of all kinds take 0.6 s before the samples, and the denoiser 1 s after
    // them.
    FinishingRates rates;
    rates.features = 0.1;
    rates.filling = 1e-7, rates.developing = 5e-7, rates.denoiser = 2e-6, rates.writing = 2.5e-7,
    rates.threads = 2;
    LaterWork later;
    later.channels = 4;
    const Finishing all = plan_finishing(1e6, 10, rates, true, later);
    EXPECT_TRUE(all.denoises);
    EXPECT_EQ(all.spacing, 1);
    EXPECT_EQ(all.feature_samples, kMostFeatureSamples);
    EXPECT_EQ(all.edge_samples, 0);
    EXPECT_DOUBLE_EQ(all.seconds(), kFirstUse * (0.05 + 0.25 + 1 + 0.5));
    // Three times as slow, and filters, whose loops are short, 3^1.5 times: more samples at edges alone take
    // 8 % of the time, and every fourth pixel is denoised.
    rates.features = 1, rates.slowdown = 3;
    const Finishing less = plan_finishing(1e6, 10, rates, true, later);
    EXPECT_TRUE(less.denoises);
    EXPECT_EQ(less.spacing, 2);
    EXPECT_EQ(less.feature_samples, 1);
    EXPECT_DOUBLE_EQ(less.edge_samples, 0.8e6);
    EXPECT_DOUBLE_EQ(less.denoise_seconds(), kFirstUse * std::pow(3, 1.5) / 4);
    EXPECT_DOUBLE_EQ(less.later_seconds, kFirstUse * 1.5);
    const Finishing measured = plan_finishing(1e6, 10, {}, false, {});
    EXPECT_EQ(measured.seconds(), 0) << "without a denoiser";
    // Each of three light groups is denoised after the render.
    rates.slowdown = 1, later.denoised = 3;
    EXPECT_DOUBLE_EQ(plan_finishing(1e6, 10, rates, false, later).seconds(),
                     kFirstUse * (0.05 + 0.25 + 3 + 0.5));
}

// A tile that takes a moment longer than there was must not cost the picture.
TEST(Finishing, TooLate_StillDenoisesAllPixelsWhereThatTakesAMoment) {
    const auto spacing = [](double denoising, double left) {
        Finishing plan;
        plan.all_denoise_seconds = denoising;
        plan.denoise_within(left, 5);
        return plan.spacing;
    };
    EXPECT_EQ(spacing(0.04, 0.1), 1);
    EXPECT_EQ(spacing(0.04, -1), 1);
    EXPECT_EQ(spacing(0.3, 0.2), 1);
    EXPECT_EQ(spacing(0.3, 0.1), 2);
    EXPECT_EQ(spacing(2, -1), 4);
}

TEST(Finishing, Picture_IsMappedByAllThreadsAndPackedByOne) {
    FinishingRates rates;
    rates.mapping = 3e-7, rates.packing = 1e-7, rates.threads = 3, rates.slowdown = 2;
    LaterWork later;
    later.pictures = 1;
    EXPECT_DOUBLE_EQ(plan_finishing(1e6, 10, rates, false, later).later_seconds, kFirstUse * 2 * (0.1 + 0.1));
}

TEST(Finishing, MeasuredRates_AreOfEveryKindOfWork) {
    const FinishingRates rates = measured_rates(1e4, Workers{2});
    EXPECT_EQ(rates.threads, 2);
    for (const double rate :
         {rates.developing, rates.filling, rates.denoiser, rates.writing, rates.mapping, rates.packing})
        EXPECT_GT(rate, 0);
}

TEST(DeadlineMonitor, AfterTheDeadline_IsStopped) {
    Monitor silent;
    DeadlineMonitor monitor(silent);
    EXPECT_FALSE(monitor.stopped());
    monitor.end_at(Deadline::after(-1));
    EXPECT_TRUE(monitor.stopped());
    monitor.end_at({});
    EXPECT_FALSE(monitor.stopped());
}

}  // namespace budget_test
}  // namespace lucerna
