#include "engine/render/method_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>

#include "engine/base/monitor.h"
#include "engine/render/render.h"
#include "engine/render/trial.h"
#include "tests/support/media.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace method_choice_test {

Job job_of(const IntegratorSettings& settings) {
    const Camera camera = testing::camera({0.5F, 0.4F, -0.6F}, {0.5F, 0.2F, 1}, 32, 32, 30);
    return testing::make_job(testing::small_cornell(), camera, settings, 1);
}

// --- which methods are equivalent ---

TEST(MethodsLike, WhatOnlyOneMethodShows_LeavesNoChoice) {
    PhotonMapSettings direct_only;
    direct_only.indirect = IndirectMethod::none;
    IgiSettings exaggerated;
    exaggerated.indirect_scale = 2;
    for (const IntegratorSettings& own : {IntegratorSettings(DirectSettings{}),
                                          IntegratorSettings(direct_only), IntegratorSettings(exaggerated)}) {
        EXPECT_EQ(methods_like(own).size(), 1U) << integrator_name(own);
    }
}

TEST(MethodsLike, QuantityAndLongestPath_AreTheSameForAll) {
    IgiSettings asked;
    asked.quantity = Quantity::illuminance;
    asked.max_depth = 3;
    const std::vector<Method> methods = methods_like(asked);
    EXPECT_GE(methods.size(), 4U);
    for (const Method& method : methods) {
        EXPECT_EQ(quantity_of(method.settings), Quantity::illuminance);
        EXPECT_EQ(max_depth_of(method.settings), 3);
    }
    ASSERT_TRUE(std::holds_alternative<PathSettings>(methods[0].settings)) << "the judge has no bias";
    EXPECT_EQ(std::get<PathSettings>(methods[0].settings).chains, 0)
        << "the first image needs no preparation";
}

// Where the camera sees little of what lamps light, photons go astray unless a pre-pass aims them.
TEST(MethodsLike, Variants_FollowAllKinds_AndAimPhotonsOfEach) {
    ProgressiveSettings asked;
    asked.pre_pass = 1000;
    const std::vector<Method> methods = methods_like(asked);
    std::vector<std::size_t> kinds, aimed;
    for (const Method& method : methods) {
        const std::size_t kind = method.settings.index();
        const bool is_new = std::find(kinds.begin(), kinds.end(), kind) == kinds.end();
        EXPECT_EQ(is_new, kinds.size() < 4 && &method == &methods[kinds.size()]) << "kinds come first";
        if (is_new) kinds.push_back(kind);
        IntegratorSettings settings = method.settings;
        for (const Field& field : fields(settings)) {
            if (field.name != "prepass") continue;
            EXPECT_EQ(field.text(), is_new || field.text() == "0" ? "0" : "65536");
            if (field.text() != "0") aimed.push_back(kind);
        }
    }
    EXPECT_EQ(kinds.size(), 4U);
    EXPECT_EQ(aimed.size(), 3U) << "all but paths have photons";
}

// With enough time no photons go astray, and no trial is spent on some that do.
TEST(MethodsLike, Aimed_AllPhotonMapsHaveAPrePass) {
    int aimed = 0;
    for (const Method& method : methods_like(PathSettings{}, true)) {
        if (const auto* maps = std::get_if<PhotonMapSettings>(&method.settings)) {
            EXPECT_GT(maps->pre_pass, 0);
            ++aimed;
        } else if (const auto* passes = std::get_if<ProgressiveSettings>(&method.settings)) {
            EXPECT_GT(passes->pre_pass, 0);
            ++aimed;
        }
    }
    EXPECT_EQ(aimed, 3);
}

// Without compensation or without caustics a part of the light is missing, so VPLs are offered only with
// both, whatever the settings.
TEST(MethodsLike, Vpls_AreOfferedWholeOrNotAtAll) {
    IgiSettings bare;
    bare.caustic_paths = 0;
    for (const IntegratorSettings& asked : {IntegratorSettings(PathSettings{}), IntegratorSettings(bare)}) {
        int offered = 0;
        for (const Method& method : methods_like(asked)) {
            const auto* igi = std::get_if<IgiSettings>(&method.settings);
            if (!igi) continue;
            ++offered;
            EXPECT_TRUE(igi->compensates());
            EXPECT_GT(igi->caustic_paths, 0);
        }
        EXPECT_GT(offered, 0);
    }
}

// --- the trial ---

TEST(TrialBlocks, AreSpreadOverTheImageAndInsideOfIt) {
    FilmSettings film;
    film.width = 203;
    film.height = 101;
    const std::vector<V2i> blocks = trial_blocks(film);
    EXPECT_EQ(blocks.size(), 256U);
    std::vector<int> quarters(4);
    for (std::size_t i = 0; i < 32; ++i) {
        EXPECT_GE(std::min(blocks[i].x, blocks[i].y), 0);
        EXPECT_LE(blocks[i].x, 203 - kTrialBlock);
        EXPECT_LE(blocks[i].y, 101 - kTrialBlock);
        ++quarters[static_cast<std::size_t>((blocks[i].x > 101) + 2 * (blocks[i].y > 50))];
    }
    for (const int quarter : quarters) EXPECT_NEAR(quarter, 8, 2);
    film.width = 3;
    film.height = 1;
    EXPECT_EQ(trial_blocks(film), std::vector<V2i>{V2i(0, 0)});
}

// The blocks' means must agree with a render of many samples, including methods whose passes are new
// estimates.
TEST(Trial, MeansAndVariances_AreThoseOfTheImage) {
    Monitor silent;
    ProgressiveSettings progressive;
    progressive.photons = 4'000;
    for (const IntegratorSettings& settings :
         {IntegratorSettings(PathSettings{}), IntegratorSettings(IgiSettings{}),
          IntegratorSettings(progressive)}) {
        Job job = job_of(settings);
        job.spp = 64;
        const Workers workers{2};
        const Image image = render(job, {1, workers}, silent).image;
        const SmallLamps lamps(job);
        Trial trial(job, lamps, settings, 7, workers, silent);
        // A variance estimated from two or three passes is too uncertain to divide by, so the trial runs
        // 32 passes, however slow the machine.
        do {
            ASSERT_TRUE(trial.run(0.1));
        } while (trial.in_passes() && trial.passes() < 32);
        EXPECT_GT(trial.sample_seconds(), 0);
        const std::vector<V2i> places = trial_blocks(job.film);
        double chi2 = 0;
        std::size_t known = 0;
        for (std::size_t b = 0; b < trial.blocks().size(); ++b) {
            double mean = 0, variance = 0;
            for (int i = 0; i < 16; ++i) {
                const V2i at = places[b] + V2i(i % 4, i / 4);
                mean += double{luminance(image.rgb_at(at.x, at.y))} / 16;
                const V3f own(image.value(at.x, at.y, 3), image.value(at.x, at.y, 4),
                              image.value(at.x, at.y, 5));
                variance += double{luminance(Rgb(own))} / 256;
            }
            const Trial::Block& block = trial.blocks()[b];
            if (block.variance() <= 0) continue;
            // VPLs and photons differ from the reference's, by a tenth of the value or less.
            const double shared = std::holds_alternative<PathSettings>(settings) ? 0 : sqr(0.1 * mean);
            chi2 += sqr(block.mean() - mean) / (block.variance() + variance + shared);
            ++known;
        }
        ASSERT_GE(known, 16U);
        EXPECT_LT(chi2 / static_cast<double>(known), 1.8) << integrator_name(settings);
        EXPECT_GT(chi2 / static_cast<double>(known), 0.05) << integrator_name(settings);
    }
}

// A block's pixels share a pass's photons, so its mean varies more than if the pixels were independent.
// Otherwise noise would be mistaken for bias.
TEST(Trial, OfPasses_KnowsTheNoiseThatABlocksPixelsShare) {
    Monitor silent;
    ProgressiveSettings settings;
    settings.photons = 2'000;
    const Job job = job_of(settings);
    const SmallLamps lamps(job);
    std::vector<std::unique_ptr<Trial>> trials;
    for (const std::uint64_t seed : {7, 8}) {
        trials.push_back(std::make_unique<Trial>(job, lamps, settings, seed, Workers{2}, silent));
        do {
            ASSERT_TRUE(trials.back()->run(0.1));
        } while (trials.back()->passes() < 24);
    }
    double known = 0, by_pixels = 0, squares = 0;
    for (std::size_t b = 0; b < trials[0]->blocks().size(); ++b) {
        squares += sqr(trials[0]->blocks()[b].mean() - trials[1]->blocks()[b].mean());
        for (const auto& trial : trials) {
            known += trial->blocks()[b].variance();
            for (const RunningStats& pixel : trial->blocks()[b].pixels)
                by_pixels += sqr(pixel.standard_error() / 16);
        }
    }
    // The image has 64 blocks, of which neighbours also share photons: the sum is known to a third or better.
    EXPECT_GT(known, 0.6 * squares);
    EXPECT_LT(known, 1.7 * squares);
    EXPECT_LT(by_pixels, 0.5 * squares) << "each by itself";
}

// A pilot takes as long with any number of photons, and hundreds of times as long as so few.
TEST(Trial, PilotOfFewPhotons_IsMadeOnce) {
    Monitor silent;
    PhotonMapSettings maps;
    maps.photons = 256;
    maps.direct = DirectMethod::mc;
    const Job job = job_of(maps);
    const SmallLamps lamps(job);
    Trial trial(job, lamps, maps, 7, Workers{2}, silent);
    ASSERT_TRUE(trial.run(0.01));
    EXPECT_GT(trial.prepare_seconds(), 0);
    EXPECT_GT(trial.once_seconds(), trial.prepare_seconds());
}

// The first radii come from as many photons as a pass has.
TEST(Trial, FirstRadii_AreMadeOnce_AndAreNoPartOfAPass) {
    Monitor silent;
    ProgressiveSettings settings;
    settings.photons = 20'000;
    const Job job = job_of(settings);
    const SmallLamps lamps(job);
    Trial trial(job, lamps, settings, 7, Workers{2}, silent);
    const Stopwatch clock;
    ASSERT_TRUE(trial.run(0.01));
    const double once = trial.once_seconds();
    EXPECT_GT(once, 0);
    while (trial.passes() < 8) ASSERT_TRUE(trial.run(0.01));
    EXPECT_EQ(trial.once_seconds(), once);
    EXPECT_LE(once + trial.passes() * trial.prepare_seconds(), clock.seconds());
}

// Passes tell their blur with a denoiser and without.
TEST(Trial, OfPasses_KnowsTheirBlur_WithoutHalvesOfTheFilm) {
    Monitor silent;
    ProgressiveSettings settings;
    settings.photons = 4'000;
    settings.direct = DirectMethod::map;
    settings.estimate.radius = 0.3F;  // of a room that is 1 wide
    Job job = job_of(settings);
    std::array<double, 2> blur{};
    for (const bool halves : {false, true}) {
        job.film.two_halves = halves;
        const SmallLamps lamps(job);
        Trial trial(job, lamps, settings, 7, Workers{2}, silent);
        while (trial.passes() < 16) ASSERT_TRUE(trial.run(0.01));
        for (const Trial::Block& block : trial.blocks()) blur[halves] += block.blur2();
    }
    EXPECT_GT(blur[0], 0);
    EXPECT_GT(blur[0] / blur[1], 0.67);
    EXPECT_LT(blur[0] / blur[1], 1.5);
}

// --- the choice ---

TEST(ChooseMethod, OfTheTimeThereIs_SaysWhatToExpectAndWhatItTried) {
    Monitor silent;
    Limits limits;
    limits.seconds = 4;
    const auto choice = choose_method(job_of(PathSettings{}), limits, 3, Workers{2}, silent);
    ASSERT_TRUE(choice.has_value());
    EXPECT_GT(choice->error, 0);
    EXPECT_LT(choice->error, 0.1);
    EXPECT_LE(choice->beyond_noise, choice->error);
    EXPECT_NE(choice->tried.find("path"), std::string::npos);
    EXPECT_NE(choice->tried.find("igi"), std::string::npos);
}

// Photons blurred over half the room make a smooth but wrong picture.
TEST(ChooseMethod, AMethodThatIsWrong_IsNotTakenForItsQuiet) {
    Monitor silent;
    PhotonMapSettings blurred;
    blurred.indirect = IndirectMethod::map;
    blurred.direct = DirectMethod::map;
    blurred.estimate.k = 5'000;
    blurred.estimate.radius = 0.5F;
    Limits limits;
    limits.error = 0.02;
    const auto choice = choose_method(job_of(blurred), limits, 3, Workers{2}, silent);
    ASSERT_TRUE(choice.has_value());
    EXPECT_FALSE(std::holds_alternative<PhotonMapSettings>(choice->settings)) << choice->tried;
}

// A point light inside a glass ball: no camera path finds it, and the path tracer's image is black without
// any noise. The light that photons find must count against it.
TEST(ChooseMethod, Long_LightThatPathsCannotFind_IsNotTakenForDarkness) {
    Monitor silent;
    testing::SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(0.6F)));
    make.sphere({0.5F, 0.5F, 0.5F}, 0.1F, make.material(DielectricMaterial{}));
    make.light(make_point_light({0.5F, 0.5F, 0.5F}, Rgb(1)));
    const Camera camera = testing::camera({0.1F, 0.5F, 0.1F}, {0.9F, 0.3F, 0.9F}, 32, 32, 60);
    Job job = testing::make_job(make.build(), camera, PathSettings{}, 1);
    Limits time, error;
    time.seconds = 8;
    error.error = 0.05;  // paths reach it at once, but the trial still runs the other methods
    for (const Limits& limits : {time, error}) {
        for (const bool denoised : {false, true}) {
            job.film.two_halves = denoised;
            const auto choice = choose_method(job, limits, 3, Workers{2}, silent);
            ASSERT_TRUE(choice.has_value());
            EXPECT_FALSE(std::holds_alternative<PathSettings>(choice->settings)) << choice->tried;
        }
    }
}

TEST(ChooseMethod, InASecond_NothingIsTried) {
    Monitor silent;
    PathSettings asked;
    asked.max_depth = 3;
    Limits limits;
    limits.seconds = 1;
    const auto choice = choose_method(job_of(asked), limits, 3, Workers{2}, silent);
    ASSERT_TRUE(choice);
    ASSERT_TRUE(std::holds_alternative<ProgressiveSettings>(choice->settings));
    EXPECT_EQ(max_depth_of(choice->settings), 3);
    EXPECT_TRUE(std::isnan(choice->error));
}

TEST(ChooseMethod, WhereAMediumGlows_OnlyPathsShowIt) {
    Monitor silent;
    testing::SceneMaker make;
    Medium fire = testing::homogeneous(Rgb(1), Rgb(0));
    fire.name = "fire";
    fire.emission = Rgb(1);
    make.region(fire);
    const Job job = testing::make_job(make.build(), testing::small_cornell_camera(2), PhotonMapSettings{}, 1);
    Limits second, minutes, error;
    second.seconds = 1;
    minutes.seconds = 1000;
    error.error = 0.1;
    for (const Limits& limits : {second, minutes, error}) {
        const auto choice = choose_method(job, limits, 3, Workers{2}, silent);
        ASSERT_TRUE(choice);
        EXPECT_TRUE(std::holds_alternative<PathSettings>(choice->settings));
        EXPECT_NE(choice->tried.find("\"fire\""), std::string::npos) << choice->tried;
    }
}

TEST(ChooseMethod, DirectLight_IsLeftAsItIs) {
    Monitor silent;
    Limits limits;
    limits.seconds = 1;
    EXPECT_FALSE(choose_method(job_of(DirectSettings{}), limits, 3, Workers{2}, silent).has_value());
}

// Methods without light groups are excluded if groups are requested, and only then.
TEST(ChooseMethod, WithLightGroups_IsOneThatTellsOfThem) {
    for (const bool parts : {true, false}) {
        testing::SceneMaker make;
        make.room({1, 1, 1}, make.diffuse(Rgb(0.5F)));
        make.light(make_point_light(V3f(0.5F), Rgb(1)));
        make.light_groups({"bulb"}, {0});
        Job job =
            testing::make_job(make.build(), testing::camera({0.5F, 0.5F, 0.1F}, {0.5F, 0.4F, 1}, 16, 16, 60),
                              PhotonMapSettings{}, 1);
        job.film.parts = parts;
        Monitor silent;
        Limits limits;
        limits.seconds = 6;
        const auto choice = choose_method(job, limits, 3, Workers{2}, silent);
        ASSERT_TRUE(choice);
        EXPECT_EQ(choice->tried.find("photonmap") == std::string::npos, parts) << choice->tried;
        EXPECT_NE(choice->tried.find("igi"), std::string::npos) << choice->tried;
    }
}

class Stopped final : public Monitor {
  public:
    bool stopped() const override { return true; }
};
TEST(ChooseMethod, UserStops_NothingIsChosen) {
    Stopped stopped;
    Limits limits;
    limits.seconds = 100;
    EXPECT_FALSE(choose_method(job_of(PathSettings{}), limits, 3, Workers{2}, stopped).has_value());
}

}  // namespace method_choice_test
}  // namespace lucerna
