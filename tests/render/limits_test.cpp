// When a render ends, and which intermediate images it shows.
#include <gtest/gtest.h>

#include "engine/base/monitor.h"
#include "engine/render/progress.h"
#include "engine/render/render.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace limits_test {

// --- the rule ---

TEST(StopRule, NoLimits_TakesAllSamples) {
    StopRule rule({}, 10);
    EXPECT_EQ(rule.next(0, 1, 0), 1);
    EXPECT_EQ(rule.next(1, 4, 100), 4);
    EXPECT_EQ(rule.next(5, 16, 1000), 5) << "no more than there are";
    EXPECT_EQ(rule.next(10, 16, 2000), 0);
    EXPECT_STREQ(rule.reason(), "samples");
}

TEST(StopRule, Time_WhatWouldNotBeDoneInTimeIsNotBegun) {
    StopRule rule({10, 0}, 1000);
    EXPECT_EQ(rule.next(0, 1, 50), 1) << "the first is always taken";
    rule = StopRule({10, 0}, 1000);
    EXPECT_EQ(rule.next(0, 1, 2), 1) << "two seconds were spent before it";
    EXPECT_EQ(rule.next(1, 2, 3), 2);   // a second each
    EXPECT_EQ(rule.next(3, 16, 5), 5);  // five seconds left
    EXPECT_EQ(rule.next(8, 16, 9.5), 0) << "half a second left at 0.9 s each";
    EXPECT_STREQ(rule.reason(), "time");
}

TEST(StopRule, GoesOnFromUnits_PaceIsThatOfItsOwn) {
    StopRule rule({100, 0}, 1000, 1, 50);
    EXPECT_EQ(rule.next(1, 1, 50), 1) << "the first took 50 s with all that preceded it, and is no pace";
    EXPECT_EQ(rule.next(2, 2, 51), 2);
    rule.end_at(52.5);
    EXPECT_EQ(rule.next(4, 4, 53), 0);
    EXPECT_STREQ(rule.reason(), "time");
}

TEST(StopRule, Error_IsNotBelievedOfFewSamples) {
    StopRule rule({std::numeric_limits<double>::infinity(), 0.01}, 1000);
    EXPECT_FALSE(rule.satisfied(2, 0.001));
    EXPECT_FALSE(rule.satisfied(100, 0.02));
    EXPECT_FALSE(rule.satisfied(100, std::nan("")));
    EXPECT_TRUE(rule.satisfied(100, 0.01));
    EXPECT_STREQ(rule.reason(), "error");
    EXPECT_FALSE(StopRule({}, 10).satisfied(100, 0)) << "nobody asked";
}

TEST(Recurring, WhatMayWait_TakesATwentiethOfTheTime) {
    for (const bool may_wait : {false, true}) {
        Recurring task(0.5, may_wait);
        EXPECT_FALSE(task.is_due(0.4));
        EXPECT_TRUE(task.is_due(0.5));
        task.done(0.5, 0.6);
        EXPECT_EQ(task.is_due(1.2), !may_wait);
        EXPECT_FALSE(task.is_due(1.0)) << "half a second after its end at the earliest";
        EXPECT_TRUE(task.is_due(0.6 + 19 * 0.1 + 1e-9));
        task.done(3, 3.001);
        EXPECT_TRUE(task.is_due(3.6)) << "what is quick is done as often as asked for";
    }
    EXPECT_TRUE(Recurring(0, true).is_due(0));
}

// --- renders ---

// Returns a job that shows the back corner without the lamp, whose edges would dominate every mean square.
Job small_job(const IntegratorSettings& settings, int spp) {
    const Camera camera = testing::camera({0.5F, 0.4F, -0.6F}, {0.5F, 0.2F, 1}, 16, 16, 30);
    return testing::make_job(testing::small_cornell(), camera, settings, spp);
}

std::vector<IntegratorSettings> both_ways() {
    ProgressiveSettings progressive;
    progressive.samples = 1;
    progressive.photons = 2000;
    return {PathSettings{}, progressive};
}

TEST(Limits, Time_EndsARenderWithoutEnd) {
    Monitor silent;
    for (const IntegratorSettings& settings : both_ways()) {
        const Job job = small_job(settings, kNoEndOfSamples);
        RenderOptions options{1, Workers{2}};
        options.limits.seconds = 0.3;
        const Stopwatch watch;
        const RenderResult result = render(job, options, silent);
        EXPECT_LT(watch.seconds(), 3) << "generous: the machine may be busy";
        EXPECT_GT(result.report.samples_done, 1);
        EXPECT_TRUE(result.report.complete);
        EXPECT_EQ(result.report.ended_by, "time");
    }
}

// Preparation that takes ten minutes of photons is given half a second: fewer photons are traced, and there
// is an image.
TEST(Limits, Time_PreparationsMakeDoWithLess) {
    Monitor silent;
    PhotonMapSettings maps;
    maps.photons = 1'000'000'000;
    ProgressiveSettings progressive;
    progressive.samples = 1;
    progressive.photons = 1'000'000'000;
    IgiSettings igi;
    igi.caustic_paths = 1'000'000'000;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(maps), IntegratorSettings(progressive), IntegratorSettings(igi)}) {
        RenderOptions options{1, Workers{2}};
        options.limits.seconds = 0.5;
        const Stopwatch watch;
        const RenderResult result = render(small_job(settings, kNoEndOfSamples), options, silent);
        EXPECT_LT(watch.seconds(), 10) << "generous: the machine may be busy";
        EXPECT_EQ(result.report.ended_by, "time");
        for (int y = 0; y < 16; ++y) {
            for (int x = 0; x < 16; ++x)
                EXPECT_GT(luminance(result.image.rgb_at(x, y)), 0) << integrator_name(settings);
        }
    }
}

TEST(Limits, Error_EndsWhenTheImageIsThatGood) {
    Monitor silent;
    for (const IntegratorSettings& settings : both_ways()) {
        RenderOptions options{1, Workers{2}};
        options.limits.error = 0.05;
        const RenderResult result = render(small_job(settings, kNoEndOfSamples), options, silent);
        EXPECT_EQ(result.report.ended_by, "error");
        EXPECT_LE(result.report.numbers().at("error.relative"), 0.05);
        // Compares with another seed: the difference has √2 times the error of one image, and at most what is
        // stated.
        options.seed = 2;
        const Image a = result.image;
        const Image b = render(small_job(settings, kNoEndOfSamples), options, silent).image;
        double square = 0;
        for (int y = 0; y < 16; ++y) {
            for (int x = 0; x < 16; ++x)
                square += double{sqr(luminance(a.rgb_at(x, y) - b.rgb_at(x, y)))} / 256;
        }
        const double measured = std::sqrt(square / 2) / testing::luminance_stats(a).mean();
        // A pixel's samples are stratified, so their mean has a smaller error than stated.
        EXPECT_LT(measured, 0.06) << integrator_name(settings);
        EXPECT_GT(measured, 0.005) << integrator_name(settings);
    }
}

TEST(Limits, SamplesOfThePasses_EndAtTheJobs) {
    Monitor silent;
    ProgressiveSettings settings;
    settings.photons = 1000;
    settings.samples = 4;
    const RenderReport report = render(small_job(settings, 10), {1, Workers{2}}, silent).report;
    EXPECT_EQ(report.passes_done, 3);
    EXPECT_EQ(report.samples_done, 10);
    EXPECT_EQ(report.ended_by, "samples");
    EXPECT_EQ(report.numbers().at("paths.emitted"), 3000);
}

TEST(Limits, Show_SeesWholeRoundsAndTheImageGrowsBetter) {
    Monitor silent;
    for (const IntegratorSettings& settings : both_ways()) {
        RenderOptions options{1, Workers{2}};
        options.show_every = 0;
        std::vector<int> samples;
        options.show = [&](const RenderResult& shown) {
            samples.push_back(shown.report.samples_done);
            EXPECT_EQ(shown.image.width, 16);
            EXPECT_TRUE(shown.image.attributes.contains("lucerna.unit"));
            for (const float value : shown.image.data) EXPECT_TRUE(std::isfinite(value));
        };
        const RenderResult shown = render(small_job(settings, 8), options, silent);
        EXPECT_EQ(samples.front(), 1);
        EXPECT_TRUE(std::is_sorted(samples.begin(), samples.end()));
        options.show = {};
        EXPECT_EQ(shown.image.data, render(small_job(settings, 8), options, silent).image.data)
            << "looking changes nothing";
    }
}

}  // namespace limits_test
}  // namespace lucerna
