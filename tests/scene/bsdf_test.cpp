// Compares every lobe's sampler with its density and value, in both directions through the surface.
#include "engine/scene/bsdf.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>
#include <ostream>

#include "engine/base/sampler.h"
#include "tests/support/lobe_histogram.h"
#include "tests/support/lobes.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace bsdf_test {

using testing::below;
using testing::chi_square;
using testing::direction;
using testing::flat;
using testing::glass;
using testing::kAlongX;
using testing::kAngles;
using testing::kFalseAlarm;
using testing::kUp;
using testing::metal;
using testing::PeakHistogram;
using testing::tilted;

struct Case {
    const char* name;
    Lobe lobe;
    bool from_inside = false;
    V3f ns = kUp;  // ng is kUp

    Bsdf bsdf() const { return {lobe, ns, kUp, kAlongX}; }
    V3f wo(float theta) const { return from_inside ? below(direction(theta)) : direction(theta); }
    float eta() const {  // index of the far side over that of wo's side
        const auto* lobe_of_glass = std::get_if<DielectricLobe>(&lobe);
        if (!lobe_of_glass) return 1;
        return from_inside ? 1 / lobe_of_glass->eta : lobe_of_glass->eta;
    }
    // The smallest width of the lobe; it sets the resolution of the histogram.
    float width() const {
        if (const auto* m = std::get_if<ConductorLobe>(&lobe)) return std::min(m->alpha_x, m->alpha_y);
        if (const auto* g = std::get_if<DielectricLobe>(&lobe)) return std::min(g->alpha_x, g->alpha_y);
        return 0.3F;
    }
};
void PrintTo(const Case& c, std::ostream* out) {
    *out << c.name;
}

using Pdf = std::function<float(const V3f& wo, const V3f& wi)>;

struct Verdict {
    double p_value;         // of the distribution of sampled directions
    double integral;        // of the density over all directions
    double drawn;           // share of the samples that were not absorbed by the sampler
    double standard_error;  // of `drawn`
};

// Compares sample() with `pdf` on both sides of the surface.
Verdict compare(const Case& c, const V3f& wo, const Pdf& pdf) {
    const Bsdf bsdf = c.bsdf();
    const float side = c.from_inside ? -1.0F : 1.0F;
    const V3f mirror(-wo.x, -wo.y, wo.z);
    const float eta = c.eta();
    const float cos_t2 = 1 - (1 - wo.z * wo.z) / (eta * eta);
    const V3f through = cos_t2 > 0 ? V3f(-wo.x / eta, -wo.y / eta, -side * std::sqrt(cos_t2)) : -wo;
    const bool is_diffuse = bsdf.is_diffuse();
    PeakHistogram reflected(is_diffuse ? c.ns * side : mirror, side, c.width());
    // A facet's tilt deflects transmitted light by |η - 1| times the tilt.
    PeakHistogram transmitted(through.normalized(), -side,
                              c.width() * std::clamp(std::fabs(eta - 1), 0.01F, 1.0F));

    constexpr int kDraws = 60'000;
    Sampler sampler(11, Purpose::test, 0, 0);
    std::uint64_t drawn = 0;
    for (int i = 0; i < kDraws; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = bsdf.sample(wo, u, Transport::radiance);
        if (!sample) continue;
        EXPECT_EQ(sample->transmission, sample->wi.z * side < 0);
        drawn += reflected.add(sample->wi) || transmitted.add(sample->wi) ? 1U : 0U;
    }

    const auto density = [&](const V3f& wi) { return static_cast<double>(pdf(wo, wi)); };
    std::vector<double> expected = reflected.integrate(density);
    const std::vector<double> other = transmitted.integrate(density);
    expected.insert(expected.end(), other.begin(), other.end());
    std::vector<std::uint64_t> counts = reflected.counts;
    counts.insert(counts.end(), transmitted.counts.begin(), transmitted.counts.end());
    double integral = 0;
    for (const double p : expected) integral += p;
    // The chi-square test is conditional on a direction being drawn; the integral covers the probability of
    // that. The midpoint rule may miss a sliver at the horizon: no bin is quite impossible.
    for (double& p : expected) p = std::max(p * static_cast<double>(drawn) / integral, 1e-9);
    const double share = static_cast<double>(drawn) / kDraws;
    return {chi_square(counts, expected).p_value, integral, share, std::sqrt(share * (1 - share) / kDraws)};
}

class BsdfSampling : public ::testing::TestWithParam<Case> {};

TEST_P(BsdfSampling, Long_Sample_AnyAngle_FollowsPdfW) {
    const Case& c = GetParam();
    const Bsdf bsdf = c.bsdf();
    const Pdf pdf = [&](const V3f& wo, const V3f& wi) { return bsdf.pdf_w(wo, wi); };
    for (const float theta : kAngles) {
        const Verdict verdict = compare(c, c.wo(theta), pdf);
        EXPECT_GE(verdict.p_value, kFalseAlarm / kAngles.size()) << "at " << theta << " degrees";
        EXPECT_NEAR(verdict.integral, verdict.drawn, 4 * verdict.standard_error + 0.004) << "at " << theta;
    }
}

TEST_P(BsdfSampling, Weight_EverySample_IsValueTimesCosineOverPdf) {
    const Case& c = GetParam();
    const Bsdf bsdf = c.bsdf();
    Sampler sampler(12, Purpose::test, 0, 0);
    for (const float theta : kAngles) {
        const V3f wo = c.wo(theta);
        for (int i = 0; i < 2000; ++i) {
            const Transport transport = i % 2 == 0 ? Transport::radiance : Transport::particles;
            const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, transport);
            if (!sample) continue;
            const float cos_i = std::fabs(sample->wi.dot(c.ns));
            const float pdf = bsdf.pdf_w(wo, sample->wi);
            const Rgb ratio = bsdf.f(wo, sample->wi, transport) * (cos_i / pdf);
            // Directions are rounded to 1e-7: the cosine errs by as much, the density by that over the lobe's
            // width.
            const float near = 1e-3F + 1e-6F / cos_i;
            for (int channel = 0; channel < 3; ++channel) {
                ASSERT_NEAR(ratio[channel], sample->weight[channel], near * sample->weight[channel] + 1e-6F)
                    << theta << " degrees, wi " << sample->wi;
            }
            ASSERT_NEAR(pdf / sample->pdf_w, 1, 1e-4F / c.width() + 1e-3F) << theta << ", wi " << sample->wi;
        }
    }
}

TEST_P(BsdfSampling, Value_DirectionsSwapped_IsTheAdjoint) {
    const Case& c = GetParam();
    const Bsdf bsdf = c.bsdf();
    Sampler sampler(13, Purpose::test, 0, 0);
    int transmitted = 0;
    for (int i = 0; i < 4000; ++i) {
        const V3f a = c.wo(89 * sampler.next());
        const auto sample = bsdf.sample(a, {sampler.next(), sampler.next2()}, Transport::particles);
        if (!sample) continue;
        const V3f b = sample->wi;
        const Rgb radiance = bsdf.f(a, b, Transport::radiance);
        const Rgb swapped = bsdf.f(b, a, Transport::radiance);
        const Rgb particles = bsdf.f(a, b, Transport::particles);
        // Helmholtz reciprocity holds for f/η², with the index on the viewer's side.
        const float eta = sample->transmission ? c.eta() : 1.0F;
        transmitted += sample->transmission ? 1 : 0;
        const float near = 2e-3F + 2e-6F / c.width() + 2e-6F / std::min(std::fabs(a.z), std::fabs(b.z));
        for (int channel = 0; channel < 3; ++channel) {
            ASSERT_NEAR(particles[channel], swapped[channel], near * swapped[channel]) << a << b;
            ASSERT_NEAR(radiance[channel] * eta * eta, swapped[channel], near * swapped[channel]) << a << b;
        }
    }
    EXPECT_EQ(transmitted > 100, std::holds_alternative<DielectricLobe>(c.lobe));
}

TEST_P(BsdfSampling, Albedo_AnyAngle_IsTheMeanWeight) {
    const Case& c = GetParam();
    const Bsdf bsdf = c.bsdf();
    Sampler sampler(14, Purpose::test, 0, 0);
    for (const float theta : kAngles) {
        const V3f wo = c.wo(theta);
        std::array<RunningStats, 3> mean;
        for (int i = 0; i < 20'000; ++i) {
            const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, Transport::particles);
            for (int k = 0; k < 3; ++k) mean[k].add(sample ? static_cast<double>(sample->weight[k]) : 0.0);
        }
        const Rgb albedo = bsdf.albedo(wo);
        for (int k = 0; k < 3; ++k) {
            const double slack = 4 * mean[k].standard_error() + 0.01;
            EXPECT_LE(mean[k].mean(), static_cast<double>(albedo[k]) + slack) << theta;
            // With bent normals the albedo is a bound, not a mean.
            if (c.ns == kUp) {
                EXPECT_GE(mean[k].mean(), static_cast<double>(albedo[k]) - slack) << theta;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(
    Lobes, BsdfSampling,
    ::testing::Values(Case{"diffuse", DiffuseLobe{Rgb(0.1F, 0.5F, 1.0F)}},
                      Case{"diffuse_bent", DiffuseLobe{Rgb(0.5F)}, false, tilted(35)},
                      Case{"diffuse_bent_below", DiffuseLobe{Rgb(0.5F)}, true, tilted(35)},
                      Case{"metal_0.001", metal(0.001F, 0.001F)}, Case{"metal_0.01", metal(0.01F, 0.01F)},
                      Case{"metal_0.1", metal(0.1F, 0.1F)}, Case{"metal_0.4", metal(0.4F, 0.4F)},
                      Case{"metal_1", metal(1, 1)}, Case{"metal_brushed", metal(0.05F, 0.4F)},
                      Case{"metal_behind", metal(0.2F, 0.1F), true},
                      Case{"glass_0.001", glass(1.5F, 0.001F, 0.001F)},
                      Case{"glass_0.01", glass(1.5F, 0.01F, 0.01F)},
                      Case{"glass_0.1", glass(1.5F, 0.1F, 0.1F)}, Case{"glass_0.5", glass(1.5F, 0.5F, 0.5F)},
                      Case{"glass_1", glass(1.5F, 1, 1)}, Case{"glass_brushed", glass(1.5F, 0.4F, 0.1F)},
                      Case{"glass_0.1_inside", glass(1.5F, 0.1F, 0.1F), true},
                      Case{"glass_0.5_inside", glass(1.5F, 0.5F, 0.5F), true},
                      Case{"glass_brushed_inside", glass(1.5F, 0.1F, 0.4F), true},
                      Case{"bubble_0.3", glass(0.7F, 0.3F, 0.3F)},
                      Case{"tinted_glass_0.2",
                           DielectricLobe{1.8F, Rgb(0.2F, 0.3F, 0.4F), Rgb(0.9F, 0.5F, 0), 0.2F, 0.2F}},
                      Case{"nearly_air_0.3", glass(1.1F, 0.3F, 0.3F)}),
    [](const auto& test) {
        std::string name = test.param.name;
        std::replace(name.begin(), name.end(), '.', '_');
        return name;
    });

TEST(BsdfSampling, Pdf_WrongOnPurpose_IsRejected) {
    const Case c{"", glass(1.5F, 0.3F, 0.3F)};
    const Bsdf bsdf = c.bsdf();
    const Bsdf wider = flat(glass(1.5F, 0.32F, 0.32F));
    const V3f wo = c.wo(42.5F);
    const Verdict too_wide = compare(c, wo, [&](const V3f& o, const V3f& i) { return wider.pdf_w(o, i); });
    EXPECT_LT(too_wide.p_value, kFalseAlarm);
    const Verdict lopsided = compare(
        c, wo, [&](const V3f& o, const V3f& i) { return bsdf.pdf_w(o, i) * (i.y < -0.3F ? 0.8F : 1.0F); });
    EXPECT_LT(lopsided.p_value, kFalseAlarm);
    EXPECT_GT(std::fabs(lopsided.integral - lopsided.drawn), 4 * lopsided.standard_error + 0.004);
}

}  // namespace bsdf_test
}  // namespace lucerna
