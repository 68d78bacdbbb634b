// Tests the importance pre-pass of instant global illumination: which lights it favours, that it preserves
// the mean, and how much variance it removes.
#include "engine/vpl/igi_pre_pass.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/defensive.h"
#include "photon/emission.h"
#include "tests/support/same_image.h"
#include "tests/support/statistics.h"
#include "tests/support/two_rooms.h"

namespace lucerna {
namespace igi_pre_pass_test {

using testing::same;

using testing::SceneMaker;
using testing::two_rooms;

constexpr int kSize = 8;

IgiSettings steered(std::int64_t pre_pass = 8192) {
    IgiSettings settings;
    settings.nlights = 16;
    settings.nsets = 4;
    settings.mindist = 0.05F;
    settings.pre_pass = pre_pass;
    settings.quantity = Quantity::illuminance;
    return settings;
}

RenderResult picture(Scene scene, const IntegratorSettings& settings, std::uint64_t seed = 0,
                     const Workers& workers = {2}, int spp = 4) {
    Monitor silent;
    RenderOptions options;
    options.seed = seed;
    options.workers = workers;
    return render(testing::make_job(std::move(scene), testing::left_camera(kSize), settings, spp), options,
                  silent);
}

IgiPrePass pre_pass_of(const Scene& scene, const IgiSettings& settings, const Workers& workers = {2}) {
    const Camera camera = testing::left_camera();
    Monitor silent;
    const RenderContext context{scene, 4, workers, silent, View{&camera, V2f(0.0F), V2f(32.0F)}};
    return run_igi_pre_pass(settings, context).value();
}

TEST(IgiPrePass, ALightThatNobodySees_IsLeftToTheDefensiveWeight) {
    for (const Quantity quantity : {Quantity::radiance, Quantity::illuminance}) {
        IgiSettings settings = steered();
        settings.quantity = quantity;
        const IgiPrePass closed = pre_pass_of(two_rooms(false), settings);
        EXPECT_GE(closed.importance.emission.probability(1), 0.25 * 0.5 * (1 - 1e-5));
        EXPECT_LE(closed.importance.emission.probability(1), 0.25 * 0.5 + 0.02);
        EXPECT_GT(closed.importance.useful, 0.1);
        EXPECT_LT(closed.importance.useful, 0.5);
        ASSERT_TRUE(closed.guides);
        const Guide guide = closed.guides->at(V3f(0.3F, 0, 0.3F), V3f(0, 1, 0));
        EXPECT_EQ(guide.probability(0, kNoCell), 1);
        // Through a passage part of its light is seen, and much of it is still not.
        const IgiPrePass open = pre_pass_of(two_rooms(true), settings);
        EXPECT_GT(open.importance.emission.probability(1), closed.importance.emission.probability(1) + 0.02);
        EXPECT_LT(open.importance.emission.probability(1), 0.45);
    }
}

// Importance differs from visibility. The light of one spot ends on the floor, in full view, but its VPLs
// there light nothing that is seen; that of the other ends on the ceiling, which is not seen but lights the
// floor.
TEST(IgiPrePass, LightThatLightsWhatIsSeen_MattersMoreThanLightThatIsSeen) {
    SceneMaker make;
    const auto white = make.diffuse(Rgb(0.6F));
    make.quad({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, white);     // the floor, all that the camera sees
    make.quad({0, 0.6F, 0}, {1, 0, 0}, {0, 0, 1}, white);  // a ceiling that faces it
    make.light(make_spot_light({0.2F, 0.5F, 0.5F}, {0, -1, 0}, Rgb(1), {20, 20}));  // lights the floor
    make.light(make_spot_light({0.8F, 0.1F, 0.5F}, {0, 1, 0}, Rgb(1), {20, 20}));   // lights the ceiling
    const Scene scene = make.build();
    const Camera camera = testing::camera({0.5F, 0.55F, 0.02F}, {0.5F, 0, 0.6F}, 32, 32, 40);
    Monitor silent;
    const Workers workers{2};
    const RenderContext context{scene, 4, workers, silent, View{&camera, V2f(0.0F), V2f(32.0F)}};
    const IgiPrePass pre_pass = run_igi_pre_pass(steered(), context).value();
    // VPLs of the first spot lie on the floor and light the ceiling; they light the floor only after one more
    // bounce.
    EXPECT_LT(pre_pass.importance.emission.probability(0), 0.4);
    EXPECT_GT(pre_pass.importance.emission.probability(1), 0.6);
}

TEST(IgiPrePass, OnAnyNumberOfThreads_LearnsAndRendersTheSame) {
    const IgiPrePass one = pre_pass_of(two_rooms(true), steered(), {1}),
                     three = pre_pass_of(two_rooms(true), steered(), {3});
    EXPECT_EQ(one.importance.emission.hash(), three.importance.emission.hash());
    EXPECT_EQ(one.guides->distributions(), three.guides->distributions());
    EXPECT_TRUE(same(picture(two_rooms(true), steered(), 1, {1}).image,
                     picture(two_rooms(true), steered(), 1, {3}).image));
}

TEST(IgiPrePass, OnOrOff_IsReported) {
    const RenderResult guided = picture(two_rooms(true), steered());
    EXPECT_EQ(guided.report.notes().at("emission"), "steered by an importance pre-pass");
    EXPECT_GT(guided.report.numbers().at("prepass.importons"), 100);
    const RenderResult plain = picture(two_rooms(true), steered(0));
    EXPECT_EQ(plain.report.notes().at("emission"), "plain: prepass = 0");
    EXPECT_FALSE(same(guided.image, plain.image));
}

TEST(IgiPrePass, WhereThereIsNothingToLearn_SaysWhyEmissionIsPlain) {
    SceneMaker dark;
    dark.room({1, 1, 1}, dark.diffuse(Rgb(0.5F)));
    EXPECT_EQ(picture(dark.build(), steered()).report.notes().at("emission"), "plain: no light shines");
    SceneMaker empty;
    empty.light(make_point_light(V3f(0.0F), Rgb(1.0F)));
    EXPECT_EQ(picture(empty.build(), steered()).report.notes().at("emission"),
              "plain: the pre-pass saw nothing");
}

TEST(IgiPrePass, StoppedByTheMonitor_IsNone) {
    const Scene scene = two_rooms(true);
    const Camera camera = testing::left_camera();
    struct : Monitor {
        bool stopped() const override { return true; }
    } stopping;
    const Workers workers{2};
    const RenderContext context{scene, 4, workers, stopping, View{&camera, V2f(0.0F), V2f(32.0F)}};
    EXPECT_FALSE(run_igi_pre_pass(steered(), context));
}

// Returns the statistics of the image's mean luminance over seeds.
RunningStats means(const IntegratorSettings& settings, std::uint64_t first, std::uint64_t seeds,
                   int spp = 4) {
    RunningStats stats;
    for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
        stats.add(
            testing::luminance_stats(picture(two_rooms(true, false), settings, seed, {2}, spp).image).mean());
    }
    return stats;
}

bool agree(const RunningStats& a, double scale, const RunningStats& b) {
    const double error = std::hypot(scale * a.standard_error(), b.standard_error());
    return std::fabs(scale * a.mean() - b.mean()) < 4 * error;
}

// The mean over seeds is that of the path tracer, with and without a pre-pass (4 sigmas, two comparisons).
TEST(IgiPrePass, SteeredSets_HaveTheMeanOfPath) {
    IgiSettings settings = steered();
    settings.mindist = 1e-6F;  // no fading
    PathSettings path;
    path.quantity = Quantity::illuminance;
    const RunningStats truth = means(path, 500, 30, 16), pre_pass = means(settings, 200, 40);
    settings.pre_pass = 0;
    const RunningStats plain = means(settings, 0, 40);
    RecordProperty("plain_path", std::to_string(plain.mean() / truth.mean()));
    RecordProperty("steered_path", std::to_string(pre_pass.mean() / truth.mean()));
    EXPECT_TRUE(agree(truth, 1, plain)) << plain.mean() << " of " << truth.mean();
    EXPECT_TRUE(agree(truth, 1, pre_pass)) << pre_pass.mean() << " of " << truth.mean();
    EXPECT_FALSE(agree(truth, 1.05, pre_pass));  // detects an error of 5 %
}

// Without the weights of the path starts a steered set would be too bright.
TEST(IgiPrePass, SteeredStarts_AreWeighted_AndTheTestSeesWrongWeights) {
    const Scene scene = two_rooms(true, false);
    const IgiPrePass pre_pass = pre_pass_of(scene, steered());
    RunningStats plain, weighted, unweighted;  // power emitted in the left room
    for (std::uint32_t pass = 0; pass < 60; ++pass) {
        for (const LearnedEmission* learned :
             {static_cast<const LearnedEmission*>(nullptr), &pre_pass.importance.emission}) {
            Emission emission(scene, 9, Purpose::vpl, pass, learned);
            double sum = 0, count = 0, flux = 0;
            emission.for_each(0, 512, [&](std::uint32_t, const std::optional<LightPathStart>& start) {
                if (!start) return;
                flux += double{luminance(start->power)};
                if (start->light != 0) return;
                sum += double{luminance(start->power)};
                ++count;
            });
            (learned ? weighted : plain).add(sum / 512);
            if (learned) unweighted.add(count * flux / 512 / 512);
        }
    }
    EXPECT_TRUE(agree(plain, 1, weighted)) << plain.mean() << " and " << weighted.mean();
    EXPECT_FALSE(agree(plain, 1, unweighted));
}

// Returns the variance of a pixel over seeds relative to its squared mean, averaged over pixels.
double relative_variance(const IgiSettings& settings) {
    std::vector<RunningStats> pixels(static_cast<std::size_t>(kSize) * kSize);
    for (std::uint64_t seed = 0; seed < 24; ++seed) {
        const Image image = picture(two_rooms(false, false), settings, seed, {2}, 16).image;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) {
                pixels[static_cast<std::size_t>(y * kSize + x)].add(luminance(image.rgb_at(x, y)));
            }
        }
    }
    double sum = 0;
    for (const RunningStats& pixel : pixels) sum += pixel.variance() / sqr(pixel.mean());
    return sum / static_cast<double>(pixels.size());
}

// Half of all paths start in the room that is not seen; of a steered set, an eighth do. The variance can thus
// fall to 4/7 at best.
TEST(IgiPrePass, SteeredSets_HaveLessVariance) {
    const double plain = relative_variance(steered(0)), pre_pass = relative_variance(steered());
    RecordProperty("plain_over_steered", std::to_string(plain / pre_pass));
    EXPECT_LT(pre_pass, 0.75 * plain);
}

// Thinning keeps its share of the lights and preserves the mean of the power they carry; without the weights
// of the kept lights the test fails.
TEST(IgiThinning, KeepsItsShareOfTheLights_AndTheMeanOfWhatTheyCarry) {
    const Scene scene = two_rooms(true, false);
    const IgiSettings settings = steered();
    const IgiPrePass pre_pass = pre_pass_of(scene, settings);
    const Camera camera = testing::left_camera();
    const Workers workers{2};
    Monitor silent;
    VplParameters parameters;
    parameters.sets = 4;
    parameters.paths = 16 * kThinning;
    const VplSets all = build_vpls(scene, parameters, workers, silent);
    const auto carried = [](const VplSets& sets, bool left) {
        double sum = 0;
        for (const Vpl& light : sets.lights) {
            if ((light.at.p.x < 1) == left) sum += double{luminance(light.contribution)};
        }
        return sum;
    };
    RunningStats count, seen, unseen, unweighted;
    float brightest = 0;
    for (const Vpl& light : all.lights) brightest = std::max(brightest, luminance(light.contribution));
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const RenderContext context{scene, seed, workers, silent, View{&camera, V2f(0.0F), V2f(32.0F)}};
        const VplSets thin = thin_vpls(all, kThinning, pre_pass.seen, settings, context);
        ASSERT_EQ(thin.begins.size(), all.begins.size());
        ASSERT_EQ(thin.begins.back(), thin.lights.size());
        count.add(static_cast<double>(thin.lights.size()));
        seen.add(carried(thin, true));
        unseen.add(carried(thin, false));
        const auto left = std::count_if(thin.lights.begin(), thin.lights.end(),
                                        [](const Vpl& light) { return light.at.p.x < 1; });
        unweighted.add(static_cast<double>(left) / static_cast<double>(thin.lights.size()));
        for (const Vpl& light : thin.lights) {
            EXPECT_LE(luminance(light.contribution), brightest * kThinning / kDefensiveWeight * 1.01F);
        }
    }
    EXPECT_NEAR(count.mean(), static_cast<double>(all.lights.size()) / kThinning, 2);
    EXPECT_LT(count.variance(),
              8);  // systematic: each of four sets is off by less than one or by its importance
    EXPECT_TRUE(testing::agrees(seen, carried(all, true))) << seen.mean() << " of " << carried(all, true);
    EXPECT_TRUE(testing::agrees(unseen, carried(all, false)))
        << unseen.mean() << " of " << carried(all, false);
    const double share = carried(all, true) / (carried(all, true) + carried(all, false));
    EXPECT_FALSE(testing::agrees(unweighted, share)) << unweighted.mean() << " and " << share;
}

}  // namespace igi_pre_pass_test
}  // namespace lucerna
