#include "engine/scene/fresnel.h"

#include <gtest/gtest.h>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"
#include "tests/support/lobes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace coat_test {

using namespace lucerna::testing;

V3f at_cosine(float mu, float phi = 0) {
    const float s = std::sqrt(1 - mu * mu);
    return {s * std::cos(phi), s * std::sin(phi), mu};
}

TEST(CoatTable, SmoothMeans_OfGlass_AreTheLiteratures) {
    // Mean reflectance of diffuse light at η = 1.5: 0.0918 from outside, 0.5963 from inside [Egan and
    // Hilgeman 1979].
    const CoatTable table(1.5F, V2f(0, 0));
    EXPECT_NEAR(table.smooth_mean(true), 0.0918, 1e-4);
    EXPECT_NEAR(table.smooth_mean(false), 0.5963, 1e-4);
    // The two are related by reciprocity: (1 - outside) = η² (1 - inside).
    EXPECT_NEAR(1 - table.smooth_mean(true), 2.25 * (1 - static_cast<double>(table.smooth_mean(false))),
                1e-4);
    EXPECT_EQ(table.rough(0.5F, 0), table.smooth(0.5F, true));
    EXPECT_EQ(table.rough_mean(0), table.smooth_mean(true));
}

// Returns the mean weight of the coat's own sampler.
RunningStats sampled(const Bsdf& gloss, const V3f& wo) {
    Sampler sampler(51, Purpose::test, 0, 0);
    RunningStats mean;
    for (int i = 0; i < 40'000; ++i) {
        const auto sample = gloss.sample(wo, {sampler.next(), sampler.next2()}, Transport::radiance);
        mean.add(sample ? static_cast<double>(sample->weight.x) : 0.0);
    }
    return mean;
}

TEST(CoatTable, Rough_AnyCosine_IsTheGlossesAlbedo) {
    double worst = 0;
    for (const float alpha : {0.01F, 0.1F, 0.4F, 1.0F}) {
        const CoatTable table(1.5F, V2f(alpha, alpha));
        const Bsdf gloss = flat(GlossLobe{1.5F, Rgb(1.0F), alpha, alpha});
        for (const float mu : {0.001F, 0.01F, 0.07F, 0.2F, 0.55F, 1.0F}) {
            const RunningStats mean = sampled(gloss, at_cosine(mu));
            const double error = std::fabs(static_cast<double>(table.rough(mu, alpha)) - mean.mean());
            EXPECT_LE(error, 4 * mean.standard_error() + 0.003) << alpha << " at " << mu;
            worst = std::max(worst, error);
        }
    }
    RecordProperty("worst_error", std::to_string(worst));
}

TEST(CoatTable, Brushed_AnyAzimuth_IsNotExceeded) {
    const CoatTable table(1.5F, V2f(0.05F, 0.5F));
    const Bsdf gloss = flat(GlossLobe{1.5F, Rgb(1.0F), 0.05F, 0.5F});
    for (const float mu : {0.005F, 0.05F, 0.3F, 1.0F}) {
        for (const float phi : {0.0F, 0.3F, 0.8F, 1.3F, 1.57F, 2.5F}) {
            const RunningStats mean = sampled(gloss, at_cosine(mu, phi));
            EXPECT_GE(static_cast<double>(table.rough(mu, 0)),
                      mean.mean() - 4 * mean.standard_error() - 0.003)
                << mu << " " << phi;
        }
    }
    // The test would reject half of the tabulated value.
    const RunningStats mean = sampled(gloss, at_cosine(0.05F));
    EXPECT_LT(static_cast<double>(table.rough(0.05F, 0)) / 2,
              mean.mean() - 4 * mean.standard_error() - 0.003);
}

TEST(CoatTable, OfAnyAlpha_IsNearTheExactOne) {
    const CoatTable any(1.5F);
    EXPECT_TRUE(any.any_alpha());
    for (const float alpha : {0.0F, 0.003F, 0.02F, 0.15F, 0.6F, 1.6F}) {
        const CoatTable exact(1.5F, V2f(alpha, alpha));
        EXPECT_FALSE(exact.any_alpha());
        for (const float mu : {0.0F, 0.004F, 0.03F, 0.1F, 0.4F, 1.0F}) {
            EXPECT_NEAR(any.rough(mu, alpha), exact.rough(mu, alpha), 0.011) << alpha << " at " << mu;
        }
        EXPECT_NEAR(any.rough_mean(alpha), exact.rough_mean(alpha), 1e-3) << alpha;
    }
}

TEST(CoatTable, Mean_IsThatOfItsOwnFunction) {
    const CoatTable table(1.7F, V2f(0.3F, 0.3F));
    double sum = 0;
    constexpr int kSteps = 100'000;
    for (int i = 0; i < kSteps; ++i) {
        const double mu = (i + 0.5) / kSteps;
        sum += 2 * mu * static_cast<double>(table.rough(static_cast<float>(mu), 0)) / kSteps;
    }
    EXPECT_NEAR(table.rough_mean(0), sum, 1e-5);
}

}  // namespace coat_test
}  // namespace lucerna
