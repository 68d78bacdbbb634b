// Tests frames of a flythrough: with one seed the VPLs stay where they are as the camera moves, so that what
// stands still does not flicker.
#include <gtest/gtest.h>

#include "engine/integrators/integrator.h"
#include "tests/support/one_pass.h"
#include "tests/support/scenes.h"

namespace lucerna {
namespace igi_flythrough_test {

constexpr int kSize = 16;

IgiSettings few_lights(std::int64_t pre_pass = 0) {
    IgiSettings settings;
    settings.nlights = 16;
    settings.nsets = 4;
    settings.pre_pass = pre_pass;
    settings.quantity = Quantity::illuminance;
    return settings;
}

testing::OnePass prepared(const Scene& scene, const Camera& camera, std::uint64_t seed,
                          std::int64_t pre_pass = 0) {
    Monitor silent;
    const Workers workers{2};
    return {few_lights(pre_pass),
            {scene, seed, workers, silent, View{&camera, V2f(0.0F), V2f(float{kSize})}}};
}

Camera from(const V3f& eye) {
    return testing::camera(eye, {0.5F, 0.5F, 1}, kSize, kSize, 40);
}

// Returns the mean radiance of a patch of the back wall as a camera at `eye` sees it, from the estimator's
// VPLs and the eye's own samples.
double patch(const testing::OnePass& estimator, const V3f& eye, std::uint64_t seed) {
    constexpr std::uint32_t kAcross = 8, kSamples = 16;
    double sum = 0;
    for (std::uint32_t i = 0; i < kAcross * kAcross; ++i) {
        const V3f at(0.1F + 0.03F * static_cast<float>(i % kAcross),
                     0.4F + 0.03F * static_cast<float>(i / kAcross), 1);
        const auto family = (static_cast<std::uint64_t>(eye.x * 1000) << 32) | i;  // differs by camera
        for (std::uint32_t sample = 0; sample < kSamples; ++sample) {
            Sampler sampler = Sampler::stratified(seed, Purpose::test, family, sample);
            sum += double{luminance(estimator.Li(Ray{eye, (at - eye).normalized()}, sampler))};
        }
    }
    return sum / (kAcross * kAcross * kSamples);
}

const V3f kHere(0.5F, 0.5F, -1.4F), kThere(0.53F, 0.5F, -1.35F);  // one frame later

// The comparison is bit for bit: the radiance along a ray does not depend on the camera for which a pass was
// prepared.
TEST(IgiFlythrough, OfOneSeed_KeepsItsVpls) {
    const Scene scene = testing::small_cornell();
    const auto here = prepared(scene, from(kHere), 5), there = prepared(scene, from(kThere), 5),
               fresh = prepared(scene, from(kThere), 6);
    int differ = 0;
    for (std::uint32_t i = 0; i < 100; ++i) {
        const V3f at(0.009F * static_cast<float>(i) + 0.05F, 0.7F, 1);
        const auto seen = [&](const testing::OnePass& estimator) {
            Sampler sampler = Sampler::stratified(1, Purpose::test, 0, i);
            return estimator.Li(Ray{kHere, (at - kHere).normalized()}, sampler);
        };
        EXPECT_EQ(seen(here), seen(there));
        differ += seen(here) == seen(fresh) ? 0 : 1;
    }
    EXPECT_GT(differ, 90);
}

TEST(IgiFlythrough, OfOneSeed_DoesNotFlickerAsFreshSeedsDo) {
    const Scene scene = testing::small_cornell();
    double fixed = 0, fresh = 0, mean = 0;
    constexpr int kPairs = 10;
    for (std::uint64_t seed = 0; seed < kPairs; ++seed) {
        const auto here = prepared(scene, from(kHere), seed), there = prepared(scene, from(kThere), seed),
                   other = prepared(scene, from(kThere), seed + 100);
        const double before = patch(here, kHere, seed);
        mean += before / kPairs;
        fixed += sqr(patch(there, kThere, seed) - before) / kPairs;
        fresh += sqr(patch(other, kThere, seed + 100) - before) / kPairs;
    }
    RecordProperty("fixed", std::to_string(std::sqrt(fixed) / mean));
    RecordProperty("fresh", std::to_string(std::sqrt(fresh) / mean));
    EXPECT_GT(std::sqrt(fresh), 0.02 * mean);
    EXPECT_LT(std::sqrt(fixed), 0.2 * std::sqrt(fresh));
}

// A pre-pass traces rays from the camera, so the VPLs that it keeps depend on the view.
TEST(IgiFlythrough, ByAPrePass_DependsOnTheCamera) {
    const Scene scene = testing::small_cornell();
    const auto here = prepared(scene, from(kHere), 5, 4096), there = prepared(scene, from(kThere), 5, 4096);
    const V3f at(0.3F, 0.7F, 1);
    Sampler a = Sampler::stratified(1, Purpose::test, 0, 0), b = a;
    EXPECT_NE(here.Li(Ray{kHere, (at - kHere).normalized()}, a),
              there.Li(Ray{kHere, (at - kHere).normalized()}, b));
}

}  // namespace igi_flythrough_test
}  // namespace lucerna
