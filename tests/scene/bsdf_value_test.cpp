// Values of lobes, against the textbook and the laws of Fresnel and Snell; and conservation of energy.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/fresnel.h"
#include "tests/support/lobes.h"

namespace lucerna {
namespace bsdf_value_test {

using testing::below;
using testing::direction;
using testing::flat;
using testing::glass;
using testing::kAlongX;
using testing::kAngles;
using testing::kUp;
using testing::metal;
using testing::tilted;

// --- Values against the textbook

// Walter et al. 2007 in double precision, in the paper's own form: it shares only Fresnel's term with the
// code under test.
struct Textbook {
    double alpha;
    double d(const V3d& m) const {
        const double cos2 = m.z * m.z;
        const double tan2 = (1 - cos2) / cos2;
        return alpha * alpha / (std::numbers::pi * cos2 * cos2 * sqr(alpha * alpha + tan2));
    }
    double lambda(const V3d& w) const {
        const double tan2 = (1 - w.z * w.z) / (w.z * w.z);
        return (std::sqrt(1 + alpha * alpha * tan2) - 1) / 2;
    }
};

TEST(BsdfValue, RoughMetal_AgainstTextbook_IsEqual) {
    Sampler sampler(15, Purpose::test, 0, 0);
    for (int i = 0; i < 2000; ++i) {
        const float alpha = 0.05F + sampler.next();
        const V3f o = direction(88 * sampler.next(), 6 * sampler.next());
        const V3f w = direction(88 * sampler.next(), 6 * sampler.next());
        const Textbook book{static_cast<double>(alpha)};
        const V3d m = (V3d(o) + V3d(w)).normalized();
        const double g = 1 / (1 + book.lambda(V3d(o)) + book.lambda(V3d(w)));
        const double fresnel = fresnel_conductor(static_cast<float>(V3d(o).dot(m)), 0.2F, 3.9F);
        const double f = fresnel * book.d(m) * g / (4 * static_cast<double>(o.z) * static_cast<double>(w.z));
        ASSERT_NEAR(flat(metal(alpha, alpha)).f(o, w, Transport::radiance).x, f, 1e-3 * f + 1e-9);
    }
}

TEST(BsdfValue, RoughGlass_AgainstTextbook_IsEqual) {
    Sampler sampler(16, Purpose::test, 0, 0);
    for (int i = 0; i < 2000; ++i) {
        const float alpha = 0.05F + sampler.next();
        const float eta_i = 1.33F;  // inside, where the light comes from; the viewer is outside
        const V3f o = direction(88 * sampler.next(), 6 * sampler.next());
        const V3f w = below(direction(88 * sampler.next(), 6 * sampler.next()));
        const Textbook book{static_cast<double>(alpha)};
        const double n = eta_i;
        const V3d m = -(n * V3d(w) + V3d(o)).normalized();
        const double om = V3d(o).dot(m);
        const double im = V3d(w).dot(m);
        double f = 0;
        if (m.z > 0 && om > 0 && im < 0) {
            const double g = 1 / ((1 + book.lambda(V3d(o))) * (1 + book.lambda(V3d(w))));
            const double t =
                1 - static_cast<double>(fresnel_dielectric(static_cast<float>(om), eta_i).reflectance);
            f = std::fabs(im * om / (static_cast<double>(o.z) * static_cast<double>(w.z))) * t * g *
                book.d(m) / sqr(n * im + om);
        }
        const float ours = flat(glass(eta_i, alpha, alpha)).f(o, w, Transport::radiance).x;
        if (std::min({std::fabs(om), std::fabs(im), std::fabs(m.z)}) < 1e-4)
            continue;  // at the limit of visibility
        ASSERT_NEAR(ours, f, 5e-3 * f + 1e-7) << o << w;
    }
}

TEST(BsdfValue, Diffuse_OneSide_IsAlbedoOverPi) {
    const Bsdf bsdf = flat(DiffuseLobe{Rgb(0.25F, 0.5F, 1)});
    const Rgb f = bsdf.f(direction(80), direction(10, 2), Transport::radiance);
    EXPECT_FLOAT_EQ(f.y, 0.5F / kPi);
    EXPECT_EQ(f, bsdf.f(below(direction(80)), below(direction(10, 2)), Transport::particles));
    EXPECT_TRUE(is_black(bsdf.f(direction(80), below(direction(10)), Transport::radiance)));
}

// --- Smooth lobes

TEST(BsdfSmooth, Mirror_AnyAngle_ReflectsAboutTheNormal) {
    const Bsdf bsdf = flat(MirrorLobe{Rgb(0.9F, 0.5F, 0)});
    for (const float theta : kAngles) {
        const V3f wo = direction(theta);
        const auto sample = bsdf.sample(wo, {0.5F, {0.5F, 0.5F}}, Transport::radiance);
        ASSERT_TRUE(sample && sample->delta && !sample->transmission);
        EXPECT_LT((sample->wi - V3f(-wo.x, -wo.y, wo.z)).length(), 1e-6F);
        EXPECT_EQ(sample->weight, Rgb(0.9F, 0.5F, 0));
        EXPECT_EQ(bsdf.albedo(wo), Rgb(0.9F, 0.5F, 0));
        EXPECT_EQ(bsdf.pdf_w(wo, sample->wi), 0);
        EXPECT_TRUE(is_black(bsdf.f(wo, sample->wi, Transport::radiance)));
    }
}

TEST(BsdfSmooth, Glass_BothSides_FollowsSnellAndFresnel) {
    const Bsdf bsdf = flat(glass(1.5F, 0, 0));
    ASSERT_TRUE(bsdf.is_delta());
    for (const float side : {1.0F, -1.0F}) {
        const float eta = side > 0 ? 1.5F : 1 / 1.5F;
        for (const float theta : kAngles) {
            const V3f wo = direction(theta) * side;
            const float fresnel = fresnel_dielectric(std::fabs(wo.z), eta).reflectance;
            int transmitted = 0;
            constexpr int kSteps = 10'000;
            for (int i = 0; i < kSteps; ++i) {
                const BsdfU u{(static_cast<float>(i) + 0.5F) / kSteps, {0, 0}};
                const auto particle = bsdf.sample(wo, u, Transport::particles);
                const auto radiance = bsdf.sample(wo, u, Transport::radiance);
                ASSERT_TRUE(particle && radiance && particle->delta);
                ASSERT_NEAR(particle->weight.x, 1, 1e-5F);
                ASSERT_EQ(particle->eta_scale, 1);
                ASSERT_NEAR(radiance->weight.x, radiance->eta_scale, 1e-5F);
                if (!particle->transmission) continue;
                ++transmitted;
                ASSERT_NEAR(radiance->eta_scale, 1 / (eta * eta), 1e-5F);
                // Snell's law: the tangential component shrinks by eta and changes its sign.
                ASSERT_NEAR(particle->wi.x, -wo.x / eta, 1e-6F);
                ASSERT_NEAR(particle->wi.y, -wo.y / eta, 1e-6F);
                ASSERT_LT(particle->wi.z * side, 0);
            }
            EXPECT_NEAR(static_cast<float>(transmitted) / kSteps, 1 - fresnel, 2e-4F) << theta;
            EXPECT_NEAR(bsdf.albedo(wo).x, 1, 1e-6F);
        }
    }
}

TEST(BsdfSmooth, Metal_AnyAngle_WeighsByFresnel) {
    const Bsdf bsdf = flat(metal(0.0005F, 0.0005F));  // under kSmoothAlpha
    ASSERT_TRUE(bsdf.is_delta());
    const V3f wo = direction(60);
    const Rgb fresnel = fresnel_conductor(wo.z, Rgb(0.2F, 0.92F, 1.1F), Rgb(3.9F, 2.45F, 2.14F));
    EXPECT_EQ(bsdf.sample(wo, {0, {0, 0}}, Transport::radiance)->weight, fresnel);
    EXPECT_EQ(bsdf.albedo(wo), fresnel);
}

TEST(BsdfSmooth, GlassOfEtaOne_RoughAndBent_PassesStraightThrough) {
    const Bsdf bsdf(glass(1, 0.5F, 0.5F), tilted(40), kUp, kAlongX);
    EXPECT_TRUE(bsdf.is_delta());
    for (const V3f& wo : {direction(0), direction(89.99F), below(direction(50)), V3f(1, 0, 0)}) {
        const auto sample = bsdf.sample(wo, {0, {0.3F, 0.3F}}, Transport::radiance);
        ASSERT_TRUE(sample);
        EXPECT_EQ(sample->wi, -wo);
        EXPECT_EQ(sample->weight, Rgb(1.0F));
        EXPECT_EQ(sample->eta_scale, 1);
        EXPECT_TRUE(sample->transmission);
        EXPECT_EQ(bsdf.albedo(wo), Rgb(1.0F));
    }
}

TEST(BsdfSmooth, Glass_RoughnessTowardsZero_TendsToSmooth) {
    const V3f wo = direction(50);
    const Rgb smooth = flat(glass(1.5F, 0, 0)).albedo(wo);
    EXPECT_NEAR(flat(glass(1.5F, 0.001F, 0.001F)).albedo(wo).x, smooth.x, 1e-4F);
    EXPECT_NEAR(flat(metal(0.001F, 0.001F)).albedo(wo).x, flat(metal(0, 0)).albedo(wo).x, 1e-4F);
}

// --- Energy

// Returns the mean weight over a dense grid of facets; for glass, one axis of the grid selects the lobe.
double dense_albedo(const Bsdf& bsdf, const V3f& wo) {
    constexpr std::uint32_t kPoints = 1U << 15;
    double sum = 0;
    for (std::uint32_t i = 0; i < kPoints; ++i) {
        const auto sample =
            bsdf.sample(wo, {to_unit(i * 2654435769U), {to_unit(reverse_bits(i)), to_unit(sobol_1(i))}},
                        Transport::particles);
        if (sample) sum += static_cast<double>(sample->weight.x);
    }
    return sum / kPoints;
}

TEST(BsdfEnergy, Albedo_RoughLobes_IsWithinOnePercent) {
    constexpr std::array<std::array<float, 2>, 7> alphas{
        {{0.001F, 0.001F}, {0.01F, 0.01F}, {0.1F, 0.1F}, {0.3F, 0.3F}, {1, 1}, {0.05F, 0.5F}, {1, 0.01F}}};
    double worst = 0;
    for (const auto& [ax, ay] : alphas) {
        for (const float theta : {0.0F, 42.0F, 60.0F, 75.0F, 85.0F, 89.0F, 89.9F}) {
            for (const auto& [lobe, side] : {std::pair<Lobe, float>{metal(ax, ay), 1.0F},
                                             {glass(1.5F, ax, ay), 1.0F},
                                             {glass(1.5F, ax, ay), -1.0F}}) {
                const Bsdf bsdf = flat(lobe);
                const V3f wo = direction(theta, 1.2F) * side;
                const double error =
                    std::fabs(static_cast<double>(bsdf.albedo(wo).x) - dense_albedo(bsdf, wo));
                EXPECT_LT(error, 0.0105) << ax << " " << ay << " at " << theta << (side > 0 ? "" : " inside");
                worst = std::max(worst, error);
            }
        }
    }
    RecordProperty("worst_error", std::to_string(worst));
    std::printf("[ worst    ] albedo error %.4f\n", worst);
}

}  // namespace bsdf_value_test
}  // namespace lucerna
