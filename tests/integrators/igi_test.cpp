// Tests that instant global illumination is unbiased at every least distance: compensation adds what the
// bound removes.
#include <gtest/gtest.h>

#include "engine/vpl/vpl_shading.h"
#include "tests/support/media.h"
#include "tests/support/region_means.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace igi_test {

using testing::all_but_the_lamp;
using testing::compare_means;
using testing::expect_agrees;
using testing::expect_differs;
using testing::few_lights;
using testing::region_means;
using testing::RegionMeans;
using testing::SceneMaker;

// Selects the pixels along the edges at which the box's back wall meets the others.
bool along_edges(double x, double y) {
    const double at = std::max(std::fabs(x), std::fabs(y));
    return 0.48 < at && at < 0.7;
}

constexpr int kSets = 1024;

RegionMeans means(Scene scene, const IntegratorSettings& settings, int spp, int seeds = 6) {
    const Job job = testing::make_job(std::move(scene), testing::small_cornell_camera(16), settings, spp);
    return region_means(job, seeds, all_but_the_lamp, along_edges);
}

// --- the bound

TEST(ClampedGeometry, Clamped_IsAShareThatGrowsWithDistance_AndOneFarAway) {
    for (const ClampedGeometry bound : {ClampedGeometry(0.5F, 0), ClampedGeometry(0, 3),
                                        ClampedGeometry(0.5F, 3), ClampedGeometry(0.1F, 3)}) {
        for (const float cosines : {1.0F, 0.2F, 1e-6F}) {
            float before = 0;
            for (float d = 0.001F; d < 10; d *= 1.05F) {
                const float clamped = bound.clamped(d * d, cosines, 1e-5F);
                EXPECT_GE(clamped, before);
                EXPECT_LE(clamped, 1);
                before = clamped;
            }
            EXPECT_EQ(before, 1);
        }
    }
}

TEST(ClampedGeometry, Clamp_LimitsTheFactorItself) {
    const ClampedGeometry bound(0, 3);
    for (const float d2 : {1e-8F, 0.01F, 0.3F}) {
        EXPECT_NEAR(bound.clamped(d2, 1, 0) / d2, 3, 1e-5F);
        EXPECT_NEAR(bound.clamped(d2, 0.9F * 3 * d2, 0), 1, 1e-6F);
    }
}

TEST(ClampedGeometry, WithinTheErrorOfPositions_IsZero) {
    EXPECT_EQ(ClampedGeometry(0, 0).clamped(0.9e-8F, 1, 1e-4F), 0);
    EXPECT_EQ(ClampedGeometry(0, 0).clamped(0, 0, 0), 0);
    EXPECT_EQ(ClampedGeometry(0, 0).clamped(1.1e-8F, 1, 1e-4F), 1);
    EXPECT_EQ(ClampedGeometry(0, 2).clamped(1e-30F, 0, 0), 1) << "a cosine of 0 needs no clamp";
}

// --- energy (tests/reference has the same on scenes of the repository)

class Compensation : public ::testing::Test {
  protected:
    static const RegionMeans& path() {
        static const RegionMeans means_of_path = means(testing::small_cornell(), PathSettings{}, 256);
        return means_of_path;
    }
    const float diagonal_ = diagonal(testing::small_cornell());
};

TEST_F(Compensation, AtAnyLeastDistance_AgreesWithPath) {
    for (const float share : {1e-6F, 0.05F, 0.2F}) {
        expect_agrees(means(testing::small_cornell(), few_lights(share * diagonal_, kSets), 32), path(),
                      fmt::format("mindist {} of the diagonal", share), 0.006);
    }
}

TEST_F(Compensation, OfAClampedFactor_AgreesWithPath) {
    IgiSettings igi = few_lights(0, kSets);
    igi.glimit = 2;
    expect_agrees(means(testing::small_cornell(), igi, 32), path(), "clamp", 0.006);
    igi.mindist = 0.1F * diagonal_;
    expect_agrees(means(testing::small_cornell(), igi, 32), path(), "fade and clamp", 0.006);
}

TEST_F(Compensation, Without_TheSameTestRejects) {
    IgiSettings igi = few_lights(0.2F * diagonal_, kSets);
    igi.gather_samples = 0;
    expect_differs(means(testing::small_cornell(), igi, 32), path(), "fade");
    igi.mindist = 1e-6F;  // no fading
    igi.glimit = 2;
    expect_differs(means(testing::small_cornell(), igi, 32), path(), "clamp");
}

// Direct light is unaffected by the scale of indirect light.
TEST_F(Compensation, IsScaledAsAllIndirectLightIs) {
    IgiSettings igi = few_lights(0.2F * diagonal_, kSets);
    igi.indirect_scale = 0;
    const RegionMeans direct = means(testing::small_cornell(), DirectSettings{}, 32);
    expect_agrees(means(testing::small_cornell(), igi, 32), direct, "none of it", 0.006);
    igi.indirect_scale = 3;
    const RegionMeans thrice = means(testing::small_cornell(), igi, 32);
    const double expected = 3 * path().whole.mean() - 2 * direct.whole.mean();
    EXPECT_NEAR(thrice.whole.mean() / expected, 1, 0.015);
}

TEST_F(Compensation, ByMoreRays_OfIlluminance_AgreesWithPath) {
    PathSettings reference;
    reference.quantity = Quantity::illuminance;
    IgiSettings igi = few_lights(0.1F * diagonal_, kSets);
    igi.quantity = Quantity::illuminance;
    igi.gather_samples = 3;
    expect_agrees(means(testing::small_cornell(), igi, 16), means(testing::small_cornell(), reference, 256),
                  "illuminance", 0.006);
}

TEST(CompensationInFog, Long_AgreesWithPath_AndWithoutItLightIsMissing) {
    const auto foggy = [] {
        return testing::small_cornell_with([](SceneMaker& make) {
            make.region(testing::in_box(testing::homogeneous(Rgb(0.1F), Rgb(1, 0.8F, 0.6F), 0.4F), V3d(0.0),
                                        V3d(1.0)));
        });
    };
    const RegionMeans path = means(foggy(), PathSettings{}, 128);
    IgiSettings igi = few_lights(0.3F, kSets);
    expect_agrees(means(foggy(), igi, 32), path, "fog", 0.01);
    igi.gather_samples = 0;
    expect_differs(means(foggy(), igi, 8), path, "fog");
}

// --- termination

Scene white_room() {
    SceneMaker make;
    make.room({1, 1, 1}, make.diffuse(Rgb(1.0F)));
    make.light(make_point_light(V3f(0.5F), Rgb(1.0F)));
    return make.build();
}

TEST(IgiWithCompensation, InARoomThatAbsorbsNothing_Ends) {
    Monitor silent;
    for (const float mindist : {1e-6F, 0.2F, 10.0F}) {
        IgiSettings igi;
        igi.nlights = 2;
        igi.nsets = 2;
        igi.mindist = mindist;
        igi.gather_samples = 1;
        const Job job =
            testing::make_job(white_room(), testing::camera(V3f(0.3F), {0.5F, 0.5F, 1}, 2, 2, 60), igi, 1);
        const Image image = render(job, {3, Workers{2}}, silent).image;
        for (const float value : image.data) EXPECT_TRUE(std::isfinite(value));
    }
}

// Seen through a glossy lobe's peak, single virtual lights are fireflies, unless rays sample the gloss.
TEST(IgiCompensation, OnAGlossyFloor_HasNoMoreNoiseThanPaths) {
    const auto variance = [](const IntegratorSettings& settings) {
        Scene scene = testing::small_cornell_with([](testing::SceneMaker& make) {
            ConductorMaterial metal;
            metal.roughness = Roughness::of_alpha(0.05F);
            make.quad({0, 0.001F, 0}, {0, 0, 1}, {1, 0, 0}, make.material(metal));
        });
        const Job job = testing::make_job(std::move(scene), testing::small_cornell_camera(24), settings, 64);
        Monitor silent;
        const Image image = render(job, {5, Workers{2}}, silent).image;
        double sum = 0;
        for (int y = 18; y < 24; ++y) {
            for (int x = 0; x < 24; ++x) sum += double{image.value(x, y, 4)};
        }
        return sum;
    };
    IgiSettings igi = testing::few_lights(0.05F, 64);
    igi.caustic_paths = 20'000;
    EXPECT_LT(variance(igi), 2 * variance(PathSettings{}));
}

}  // namespace igi_test
}  // namespace lucerna
