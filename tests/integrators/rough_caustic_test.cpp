// Tests the roughness below which a lobe counts as specular: for any threshold, light reflected by gloss is
// counted exactly once.
#include <gtest/gtest.h>

#include "engine/render/render.h"
#include "photon/bounce.h"
#include "photon/build_maps.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace rough_caustic_test {

using testing::SceneMaker;

constexpr float kAlpha = 0.12F;

ConductorMaterial rough_metal() {
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(kAlpha);
    return metal;
}
SubstrateMaterial varnished() {
    SubstrateMaterial material;
    material.diffuse = RgbTexture::constant(Rgb(0.3F, 0.5F, 0.1F));
    material.specular = RgbTexture::constant(Rgb(0.6F, 0.4F, 0.5F));
    material.roughness = Roughness::of_alpha(kAlpha);
    return material;
}

// Returns a leaning plate that reflects a spotlight onto the floor, which receives no other light.
Scene plate_over_floor(const MaterialModel& plate) {
    SceneMaker make;
    make.quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, make.diffuse(Rgb(0.7F)));
    make.quad({-0.6F, 0.2F, -0.3F}, {0.25F, 0.6F, 0}, {0, 0, 0.6F}, make.material(plate));
    make.light(make_spot_light({0.6F, 0.6F, 0}, V3f(-1.1F, -0.1F, 0).normalized(), Rgb(1.0F), {12, 8}));
    return make.build();
}

struct Measured {
    double mean;
    double caustic_photons;
};
Measured measure(const MaterialModel& plate, const IntegratorSettings& settings, int spp) {
    Monitor silent;
    const Camera camera = testing::camera({0.3F, 1.5F, 0.2F}, {0.1F, 0, 0}, 24, 24, 40);
    const Job job = testing::make_job(plate_over_floor(plate), camera, settings, spp);
    const RenderResult result = render(job, {3, Workers{}}, silent);
    const auto numbers = result.report.numbers();
    const auto found = numbers.find("photons.caustic.stored");
    return {testing::luminance_stats(result.image).mean(), found == numbers.end() ? 0 : found->second};
}

class RoughCaustic : public ::testing::TestWithParam<bool> {};

TEST_P(RoughCaustic, Long_WhicheverMapHoldsIt_IsThereOnce) {
    const MaterialModel plate = GetParam() ? MaterialModel(varnished()) : MaterialModel(rough_metal());
    const double truth = measure(plate, PathSettings{}, 1024).mean;
    for (const IndirectMethod indirect : {IndirectMethod::gather, IndirectMethod::map}) {
        for (const float below : {0.0F, 0.1F, 0.2F}) {
            PhotonMapSettings settings;
            settings.photons = 200'000;
            settings.gather_rays = 16;
            settings.indirect = indirect;
            settings.specular_below = below;
            const Measured seen = measure(plate, settings, 32);
            EXPECT_NEAR(seen.mean / truth, 1, 0.02)
                << "below " << below << (indirect == IndirectMethod::map ? ", map" : ", gather");
            EXPECT_EQ(seen.caustic_photons > 0, below > kAlpha) << "below " << below;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Plates, RoughCaustic, ::testing::Values(false, true),
                         [](const ::testing::TestParamInfo<bool>& c) {
                             return c.param ? "varnish" : "metal";
                         });

// The sharp and the blurred part of classified samples each have the mean of that part sampled alone, for
// each colour channel (4 sigmas, six comparisons).
TEST(BounceClass, VarnishedPaint_EachPartIsTheLobesOwn) {
    const Scene scene = plate_over_floor(varnished());
    const auto hit = scene.intersect(Ray{V3f(0.6F, 0.6F, 0), V3f(-1.1F, -0.1F, 0).normalized()});
    ASSERT_TRUE(hit);
    const Bsdf bsdf = scene.bsdf(*hit);
    const V3f wo = -V3f(-1.1F, -0.1F, 0).normalized();
    RunningStats sharp[3], blurred[3], sharp_alone[3], blurred_alone[3];
    Sampler sampler(1, Purpose::test, 0, 0);
    const Bsdf gloss = bsdf.sharp_part(0.2F), paint = bsdf.blurred_part(0.2F);
    const auto draw = [&](const Bsdf& from) {
        const BsdfU u{sampler.next(), sampler.next2()};
        return from.sample(wo, u, Transport::particles);
    };
    for (int i = 0; i < 200'000; ++i) {
        Rgb in_sharp(0.0F), in_blurred(0.0F);
        if (const auto sample = draw(bsdf)) {
            const BounceClass bounced = classify(bsdf, wo, *sample, 0.2F, sampler);
            (bounced.specular ? in_sharp : in_blurred) = sample->weight * bounced.scale;
        }
        const auto of_gloss = draw(gloss), of_paint = draw(paint);
        for (int c = 0; c < 3; ++c) {
            sharp[c].add(static_cast<double>(in_sharp[c]));
            blurred[c].add(static_cast<double>(in_blurred[c]));
            sharp_alone[c].add(of_gloss ? static_cast<double>(of_gloss->weight[c]) : 0);
            blurred_alone[c].add(of_paint ? static_cast<double>(of_paint->weight[c]) : 0);
        }
    }
    for (int c = 0; c < 3; ++c) {
        const double gloss_error = std::hypot(sharp[c].standard_error(), sharp_alone[c].standard_error());
        const double paint_error = std::hypot(blurred[c].standard_error(), blurred_alone[c].standard_error());
        EXPECT_NEAR(sharp[c].mean(), sharp_alone[c].mean(), 4 * gloss_error);
        EXPECT_NEAR(blurred[c].mean(), blurred_alone[c].mean(), 4 * paint_error);
        EXPECT_GT(sharp[c].mean(), 0.05);
    }
    EXPECT_TRUE(bsdf.sharp_part(kAlpha).is_black());  // the limit itself is excluded
}

}  // namespace rough_caustic_test
}  // namespace lucerna
