// Instant global illumination is right at every least distance: what a bound cuts off, compensation puts
// back.
#include <gtest/gtest.h>

#include "engine/render/igi_bound.h"
#include "lights/measured.h"
#include "tests/lights/field_fixtures.h"
#include "tests/support/media.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace {

using testing::compare_means;
using testing::region_means;
using testing::RegionMeans;
using testing::SceneMaker;

constexpr int kSize = 24;
constexpr int kSeeds = 16;

// Along the edges at which the box's back wall meets the others.
bool along_edges(double x, double y) {
    const double at = std::max(std::fabs(x), std::fabs(y));
    return 0.48 < at && at < 0.7;
}

IgiSettings few_lights(float mindist) {
    IgiSettings igi;
    igi.nlights = 16;
    igi.nsets = 64;
    igi.mindist = mindist;
    igi.max_specular_depth = 64;
    return igi;
}

RegionMeans means(Scene scene, const IntegratorSettings& settings, int spp, int seeds = kSeeds,
                  int size = kSize) {
    return region_means(
        testing::make_job(std::move(scene), testing::small_cornell_camera(size), settings, spp), seeds,
        along_edges);
}

// Within four standard errors, and within 1 % of the mean. `noise`: what one sigma must not exceed, or the
// test says nothing.
void expect_agrees(const RegionMeans& ours, const RegionMeans& reference, const std::string& what,
                   double noise = 0.004) {
    for (RunningStats RegionMeans::*which : {&RegionMeans::whole, &RegionMeans::part}) {
        const auto compared = compare_means(ours.*which, reference.*which);
        const std::string where = what + (which == &RegionMeans::whole ? ", whole" : ", edges");
        EXPECT_LT(compared.sigmas, 4) << where << " " << compared.ratio;
        EXPECT_LT(compared.noise, noise) << where;
        EXPECT_NEAR(compared.ratio, 1, 0.01) << where;
    }
}

void expect_differs(const RegionMeans& ours, const RegionMeans& reference, const std::string& what) {
    for (RunningStats RegionMeans::*which : {&RegionMeans::whole, &RegionMeans::part}) {
        const auto compared = compare_means(ours.*which, reference.*which);
        EXPECT_GT(compared.sigmas, 4) << what << " " << compared.ratio;
        EXPECT_GT(std::fabs(compared.ratio - 1), 0.01) << what;
    }
}

// --- the bound

TEST(NearBound, Kept_IsAShareThatGrowsWithDistance_AndOneFarAway) {
    for (const NearBound bound :
         {NearBound(0.5F, 0), NearBound(0, 3), NearBound(0.5F, 3), NearBound(0.1F, 3)}) {
        for (const float cosines : {1.0F, 0.2F, 1e-6F}) {
            float before = 0;
            for (float d = 0.001F; d < 10; d *= 1.05F) {
                const float kept = bound.kept(d * d, cosines, 1e-5F);
                EXPECT_GE(kept, before);
                EXPECT_LE(kept, 1);
                before = kept;
            }
            EXPECT_EQ(before, 1);
        }
    }
}

TEST(NearBound, Clamp_LimitsTheFactorItself) {
    const NearBound bound(0, 3);
    for (const float d2 : {1e-8F, 0.01F, 0.3F}) {
        EXPECT_NEAR(bound.kept(d2, 1, 0) / d2, 3, 1e-5F);
        EXPECT_NEAR(bound.kept(d2, 0.9F * 3 * d2, 0), 1, 1e-6F);
    }
}

TEST(NearBound, WithinWhatPositionsAreWorth_KeepsNothing) {
    EXPECT_EQ(NearBound(0, 0).kept(1e-8F, 1, 1e-4F), 0);
    EXPECT_EQ(NearBound(0, 0).kept(0, 0, 0), 0);
    EXPECT_EQ(NearBound(0, 0).kept(1.1e-8F, 1, 1e-4F), 1);
    EXPECT_EQ(NearBound(0, 2).kept(1e-30F, 0, 0), 1) << "a cosine of 0 needs no clamp";
}

// --- energy

class Compensation : public ::testing::Test {
  protected:
    static const RegionMeans& path() {
        static const RegionMeans means_of_path = means(testing::small_cornell(), PathSettings{}, 64, 8);
        return means_of_path;
    }
    const float diagonal_ = diagonal(testing::small_cornell());
};

TEST_F(Compensation, AtAnyLeastDistance_AgreesWithPath) {
    for (const float share : {0.0F, 0.01F, 0.05F, 0.2F, 1.0F}) {
        expect_agrees(means(testing::small_cornell(), few_lights(share * diagonal_), 4), path(),
                      fmt::format("mindist {} of the diagonal", share));
    }
}

TEST_F(Compensation, OfAClampedFactor_AgreesWithPath) {
    for (const float limit : {100.0F, 4.0F, 0.5F}) {
        IgiSettings igi = few_lights(0);
        igi.glimit = limit;
        expect_agrees(means(testing::small_cornell(), igi, 4), path(), fmt::format("glimit {}", limit));
        igi.compensate = false;
        const auto bare = compare_means(means(testing::small_cornell(), igi, 4).part, path().part);
        EXPECT_LT(bare.ratio, limit > 10 ? 1.0 : 0.97) << limit;
    }
    IgiSettings both = few_lights(0.1F * diagonal_);
    both.glimit = 4;
    expect_agrees(means(testing::small_cornell(), both, 4), path(), "fade and clamp");
}

TEST_F(Compensation, Without_TheSameTestRejects) {
    IgiSettings igi = few_lights(0);
    igi.compensate = false;
    expect_agrees(means(testing::small_cornell(), igi, 4), path(), "no bound");
    for (const float share : {0.05F, 0.2F}) {
        igi.mindist = share * diagonal_;
        expect_differs(means(testing::small_cornell(), igi, 4), path(), fmt::format("{}", share));
    }
}

TEST_F(Compensation, ByMoreRays_HasTheSameMean) {
    IgiSettings igi = few_lights(0.2F * diagonal_);
    igi.gather_samples = 4;
    expect_agrees(means(testing::small_cornell(), igi, 2), path(), "4 rays");
}

// Direct light counts once, however indirect light is scaled.
TEST_F(Compensation, IsScaledAsAllIndirectLightIs) {
    IgiSettings igi = few_lights(0.2F * diagonal_);
    igi.indirect_scale = 0;
    const RegionMeans direct = means(testing::small_cornell(), DirectSettings{}, 16, 8);
    expect_agrees(means(testing::small_cornell(), igi, 16), direct, "none of it");
    igi.indirect_scale = 3;
    const RegionMeans thrice = means(testing::small_cornell(), igi, 4);
    const double expected = 3 * path().whole.mean() - 2 * direct.whole.mean();
    EXPECT_NEAR(thrice.whole.mean() / expected, 1, 0.015);
}

TEST_F(Compensation, OfIlluminance_AgreesWithPath) {
    PathSettings reference;
    reference.quantity = Quantity::illuminance;
    IgiSettings igi = few_lights(0.1F * diagonal_);
    igi.quantity = Quantity::illuminance;
    expect_agrees(means(testing::small_cornell(), igi, 4), means(testing::small_cornell(), reference, 64, 8),
                  "illuminance");
}

// --- what virtual lights do not carry: light that mirrors and glass turn to the last surface

Scene mirrored_room() {
    return testing::small_cornell_with([](SceneMaker& make) {
        make.quad({0.02F, 0.1F, 0.2F}, {0, 0.8F, 0}, {0, 0, 0.6F}, make.material(MirrorMaterial{}));
        make.sphere({0.3F, 0.2F, 0.3F}, 0.15F, make.material(DielectricMaterial{}));
    });
}

TEST(CompensationThroughMirrors, AgreesWithPath_AndWithoutItLightIsMissing) {
    const RegionMeans path = means(mirrored_room(), PathSettings{}, 256, 12);
    IgiSettings igi = few_lights(0.05F);
    expect_agrees(means(mirrored_room(), igi, 16), path, "mirror and glass", 0.005);
    igi.compensate = false;
    expect_differs(means(mirrored_room(), igi, 4), path, "mirror and glass");
}

// A virtual light takes a glossy surface for a Lambertian one; what compensation brings takes it as it is. So
// with gloss the image comes the nearer to the path tracer's the more is left to compensation.
TEST(CompensationOnGloss, WithoutAnyVirtualLight_IsThePathTracer) {
    const auto make_scene = [] {
        return testing::small_cornell_with([](SceneMaker& make) {
            ConductorMaterial metal;
            metal.roughness = Roughness::of_alpha(0.2F);
            make.quad({0.02F, 0.1F, 0.2F}, {0, 0.8F, 0}, {0, 0, 0.6F}, make.material(metal));
        });
    };
    const RegionMeans path = means(make_scene(), PathSettings{}, 128, 12);
    expect_agrees(means(make_scene(), few_lights(10), 64), path, "gloss, all compensated", 0.005);
    double before = INFINITY;
    for (const float mindist : {0.05F, 0.5F, 10.0F}) {
        const auto compared = compare_means(means(make_scene(), few_lights(mindist), 16).whole, path.whole);
        const double off = std::max(0.0, std::fabs(compared.ratio - 1) - 2 * compared.noise);
        EXPECT_LE(off, before) << mindist;
        EXPECT_LT(off, 0.01) << mindist;
        before = off;
    }
}

// --- media

TEST(CompensationInFog, AgreesWithPath_AndWithoutItLightIsMissing) {
    const auto foggy = [] {
        return testing::small_cornell_with([](SceneMaker& make) {
            make.region(testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(1, 0.8F, 0.6F), 0.4F), V3d(0.0),
                                        V3d(1.0)));
        });
    };
    const RegionMeans path = means(foggy(), PathSettings{}, 64, 8);
    IgiSettings igi = few_lights(0.3F);
    expect_agrees(means(foggy(), igi, 4), path, "fog", 0.005);
    igi.compensate = false;
    expect_differs(means(foggy(), igi, 4), path, "fog");
}

// --- starts from a measured light field

Scene room_of_measured_lamp() {
    SceneMaker make;
    Monitor silent;
    const LightField field = testing::random_field(testing::rig_a(), 0, 1, 61);
    MeasuredSettings settings;
    settings.power = 3;
    settings.world_from_light = M44d().translate(V3d(0.5, 0.5, 0.3));
    const auto white = make.diffuse(Rgb(0.7F));
    make.room({1, 1, 1}, white);
    make.light(make_measured_light(field, CellTable(field, {1}, silent), settings, silent));
    return make.build();
}

TEST(IgiOfAMeasuredLamp, InAClosedRoom_AgreesWithPathAtAnyLeastDistance) {
    const auto seen = [](const IntegratorSettings& settings, int spp, int seeds) {
        return region_means(
            testing::make_job(room_of_measured_lamp(),
                              testing::camera({0.5F, 0.4F, 0.05F}, {0.55F, 0.5F, 1}, kSize, kSize, 80),
                              settings, spp),
            seeds, along_edges);
    };
    const RegionMeans path = seen(PathSettings{}, 64, 12);
    for (const float mindist : {0.0F, 0.09F, 0.35F}) {
        expect_agrees(seen(few_lights(mindist), 4, kSeeds), path, fmt::format("mindist {}", mindist));
    }
}

// --- no end

TEST(IgiWithCompensation, InARoomThatAbsorbsNothing_Ends) {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(1.0F)));
    make.light(make_point_light(V3f(0.5F), Rgb(1.0F)));
    Monitor silent;
    for (const float mindist : {0.0F, 0.2F, 10.0F}) {
        IgiSettings igi = few_lights(mindist);
        igi.nlights = 2;
        igi.nsets = 2;
        const Job job =
            testing::make_job(make.build(), testing::camera(V3f(0.3F), {0.5F, 0.5F, 1}, 2, 2, 60), igi, 1);
        const Image image = render(job, {3, Workers{2}}, silent).image;
        for (const float value : image.data) EXPECT_TRUE(std::isfinite(value));
        make = SceneMaker();
        make.room({1, 1, 1}, make.diffuse(Rgb(1.0F)));
        make.light(make_point_light(V3f(0.5F), Rgb(1.0F)));
    }
}

}  // namespace
}  // namespace lucerna
