// Sums of lobes, as materials create them: sampler, density and value of every material agree, and none
// reflects more light than arrives.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <ostream>

#include "engine/base/sampler.h"
#include "engine/scene/material.h"
#include "tests/support/lobe_histogram.h"
#include "tests/support/lobes.h"
#include "tests/support/materials.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace bsdf_sums_test {

using namespace lucerna::testing;

constexpr std::array<float, 4> kSomeAngles{0, 42.5F, 75, 88.5F};  // degrees

struct Case {
    Sample sample;
    bool inside = false;
};
void PrintTo(const Case& c, std::ostream* out) {
    *out << c.sample.name;
}

// A material, seen from one of its sides.
struct Side {
    explicit Side(const Case& c) : sample(c.sample), inside(c.inside), material(c.sample.material()) {}

    Bsdf bsdf() const { return make_bsdf(material, flat_hit()); }
    V3f wo(float theta) const { return inside ? below(direction(theta)) : direction(theta); }
    float eta() const { return inside ? 1 / sample.eta : sample.eta; }
    bool has_rough_part() const { return !bsdf().is_delta(); }

    Sample sample;
    bool inside;
    Material material;
};

using Pdf = std::function<double(const V3f& wi)>;

struct Verdict {
    double p_value;         // of the directions of samples that are not deltas
    double integral;        // of the density over all directions
    double drawn;           // share of samples that are not deltas
    double standard_error;  // of `drawn`
};

Verdict compare(const Side& c, const V3f& wo, const Pdf& pdf) {
    const Bsdf bsdf = c.bsdf();
    const float side = c.inside ? -1.0F : 1.0F;
    const V3f mirror(-wo.x, -wo.y, wo.z);
    const float cos_t2 = 1 - (1 - wo.z * wo.z) / sqr(c.eta());
    const V3f through = cos_t2 > 0 ? V3f(-wo.x / c.eta(), -wo.y / c.eta(), -side * std::sqrt(cos_t2)) : -wo;
    PeakHistogram back(mirror, side, c.sample.width), on(through.normalized(), -side, c.sample.width / 2);
    constexpr int kDraws = 60'000;
    Sampler sampler(41, Purpose::test, 0, 0);
    std::uint64_t drawn = 0;
    for (int i = 0; i < kDraws; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = bsdf.sample(wo, u, Transport::radiance);
        if (!sample) continue;
        EXPECT_EQ(sample->delta, !(sample->pdf_w > 0));
        if (!sample->delta) drawn += back.add(sample->wi) || on.add(sample->wi) ? 1U : 0U;
    }
    std::vector<double> expected = back.integrate(pdf);
    const std::vector<double> other = on.integrate(pdf);
    expected.insert(expected.end(), other.begin(), other.end());
    std::vector<std::uint64_t> counts = back.counts;
    counts.insert(counts.end(), on.counts.begin(), on.counts.end());
    double integral = 0;
    for (const double p : expected) integral += p;
    for (double& p : expected) p = std::max(p * static_cast<double>(drawn) / integral, 1e-9);
    const double share = static_cast<double>(drawn) / kDraws;
    return {chi_square(counts, expected).p_value, integral, share, std::sqrt(share * (1 - share) / kDraws)};
}

class BsdfSums : public ::testing::TestWithParam<Case> {};

TEST_P(BsdfSums, Long_Sample_RoughParts_FollowPdfW) {
    const Side c(GetParam());
    const Bsdf bsdf = c.bsdf();
    if (!c.has_rough_part()) {  // no sample follows a density: there must be none
        Sampler sampler(41, Purpose::test, 0, 0);
        for (int i = 0; i < 1000; ++i) {
            const V3f wo = c.wo(kSomeAngles[static_cast<std::size_t>(i) % kSomeAngles.size()]);
            const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, Transport::radiance);
            if (!sample) continue;
            ASSERT_TRUE(sample->delta);
            ASSERT_EQ(bsdf.pdf_w(wo, sample->wi), 0);
        }
        return;
    }
    for (const float theta : kSomeAngles) {
        const V3f wo = c.wo(theta);
        const Verdict verdict =
            compare(c, wo, [&](const V3f& wi) { return static_cast<double>(bsdf.pdf_w(wo, wi)); });
        EXPECT_GE(verdict.p_value, kFalseAlarm / kSomeAngles.size()) << "at " << theta << " degrees";
        EXPECT_NEAR(verdict.integral, verdict.drawn, 4 * verdict.standard_error + 0.004) << "at " << theta;
    }
}

TEST_P(BsdfSums, Weight_RoughSamples_IsValueTimesCosineOverPdf) {
    const Side c(GetParam());
    const Bsdf bsdf = c.bsdf();
    Sampler sampler(42, Purpose::test, 0, 0);
    for (const float theta : kSomeAngles) {
        const V3f wo = c.wo(theta);
        for (int i = 0; i < 1000; ++i) {
            const Transport transport = i % 2 == 0 ? Transport::radiance : Transport::particles;
            const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, transport);
            if (!sample || sample->delta) continue;
            const float cos_i = std::fabs(sample->wi.z);
            const float pdf = bsdf.pdf_w(wo, sample->wi);
            const Rgb ratio = bsdf.f(wo, sample->wi, transport) * (cos_i / pdf);
            // Directions are rounded to 1e-7: the cosine errs by as much, the density by that over the width.
            const float near = 2e-3F + 2e-6F / cos_i;
            for (int k = 0; k < 3; ++k) {
                ASSERT_NEAR(ratio[k], sample->weight[k], near * sample->weight[k] + 1e-5F)
                    << theta << sample->wi;
            }
            ASSERT_NEAR(pdf / sample->pdf_w, 1, 1e-4F / c.sample.width + 2e-3F) << theta << sample->wi;
        }
    }
}

TEST_P(BsdfSums, Value_DirectionsSwapped_IsTheAdjoint) {
    const Side c(GetParam());
    const Bsdf bsdf = c.bsdf();
    Sampler sampler(43, Purpose::test, 0, 0);
    for (int i = 0; i < 2000; ++i) {
        const V3f a = c.wo(89 * sampler.next());
        const auto sample = bsdf.sample(a, {sampler.next(), sampler.next2()}, Transport::particles);
        if (!sample || sample->delta) continue;
        const V3f b = sample->wi;
        const Rgb swapped = bsdf.f(b, a, Transport::radiance);
        const Rgb particles = bsdf.f(a, b, Transport::particles);
        const Rgb same = bsdf.f(a, b, Transport::radiance);
        const float near = 2e-3F + 2e-6F / c.sample.width + 2e-6F / std::min(std::fabs(a.z), std::fabs(b.z));
        for (int k = 0; k < 3; ++k) {
            ASSERT_NEAR(particles[k], swapped[k], near * swapped[k] + 1e-7F) << a << b;
            if (!sample->transmission) {
                ASSERT_NEAR(same[k], swapped[k], near * swapped[k] + 1e-7F) << a << b;
            }
        }
    }
}

std::array<RunningStats, 3> mean_weight(const Bsdf& bsdf, const V3f& wo, int draws) {
    Sampler sampler(44, Purpose::test, 0, 0);
    std::array<RunningStats, 3> mean;
    for (int i = 0; i < draws; ++i) {
        const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, Transport::particles);
        for (int k = 0; k < 3; ++k) mean[k].add(sample ? static_cast<double>(sample->weight[k]) : 0.0);
    }
    return mean;
}

// The coat's albedo is tabulated from 1024 facets and interpolated linearly between cosines.
constexpr double kTableError = 0.004;

// Returns whether the mean exceeds `most` significantly.
bool exceeds(const RunningStats& mean, double most) {
    return mean.mean() > most + 4 * mean.standard_error();
}

TEST_P(BsdfSums, Energy_AnyAngle_NeverExceedsOneAndIsTheAlbedo) {
    const Side c(GetParam());
    const Bsdf bsdf = c.bsdf();
    std::vector<V3f> all;
    for (const float theta : kSomeAngles) all.push_back(c.wo(theta));
    for (const float z : {1e-3F, 1e-2F, 0.05F}) all.emplace_back(std::sqrt(1 - z * z), 0, c.inside ? -z : z);
    for (const V3f& wo : all) {
        const auto mean = mean_weight(bsdf, wo, 20'000);
        const Rgb albedo = bsdf.albedo(wo);
        for (int k = 0; k < 3; ++k) {
            EXPECT_FALSE(exceeds(mean[k], 1 + kTableError)) << wo << " " << mean[k].mean();
            EXPECT_NEAR(static_cast<double>(albedo[k]), mean[k].mean(), 4 * mean[k].standard_error() + 0.012)
                << wo;
        }
    }
}

TEST_P(BsdfSums, TwoParts_DiffuseAndRest_AddUpToTheWhole) {
    const Side c(GetParam());
    const Bsdf whole = c.bsdf(), diffuse = whole.diffuse_part(), rest = whole.rest();
    EXPECT_EQ(whole.has_diffuse(), diffuse.is_diffuse());
    EXPECT_FALSE(rest.has_diffuse());
    EXPECT_EQ(whole.is_diffuse(), whole.has_diffuse() && rest.is_black());
    Sampler sampler(45, Purpose::test, 0, 0);
    for (int i = 0; i < 300; ++i) {
        const V3f wo = c.wo(89 * sampler.next());
        const V3f wi = direction(180 * sampler.next(), 6.28F * sampler.next());
        const Rgb sum = diffuse.f(wo, wi, Transport::radiance) + rest.f(wo, wi, Transport::radiance);
        const Rgb all = whole.f(wo, wi, Transport::radiance);
        ASSERT_LE(max_component(sum - all), 1e-5F * max_component(all)) << wo << wi;
        ASSERT_LE(max_component(all - sum), 1e-5F * max_component(all)) << wo << wi;
    }
}

std::vector<Case> both_sides() {
    std::vector<Case> all;
    for (const Sample& sample : all_materials()) {
        all.push_back({sample, false});
        all.push_back({sample, true});
    }
    return all;
}
INSTANTIATE_TEST_SUITE_P(Materials, BsdfSums, ::testing::ValuesIn(both_sides()), [](const auto& test) {
    return test.param.sample.name + (test.param.inside ? "_inside" : "");
});

// --- The statistics reject wrong lobes

TEST(BsdfSumsReject, Pdf_OfOneLobeOnly_IsRejected) {
    const Side plastic(Case{{"", [] { return uber(grey(0.5F), grey(0.4F), 0.2F, 0.2F); }, 0.2F}});
    const Bsdf diffuse = plastic.bsdf().diffuse_part();
    const V3f wo = plastic.wo(42.5F);
    const Verdict alone =
        compare(plastic, wo, [&](const V3f& wi) { return static_cast<double>(diffuse.pdf_w(wo, wi)); });
    EXPECT_LT(alone.p_value, kFalseAlarm);
}

TEST(BsdfSumsReject, Energy_OfPbrtsBrightPlastic_IsSeenToExceedOne) {
    // pbrt adds Kd = 1 and Ks = 1 without a limit.
    const std::array<Lobe, 2> lobes{DiffuseLobe{Rgb(1.0F)}, GlossLobe{1.5F, Rgb(1.0F), 0.2F, 0.2F}};
    const Bsdf bsdf(lobes, kUp, kUp, kAlongX);
    EXPECT_TRUE(exceeds(mean_weight(bsdf, direction(75), 20'000)[0], 1 + kTableError));
}

// --- White furnaces: nothing is lost

TEST(BsdfFurnace, WhiteUnderVarnish_AnyRoughness_ReflectsAll) {
    for (const float eta : {1.3F, 1.5F, 2.0F}) {
        for (const float alpha : {0.0F, 0.01F, 0.1F, 0.5F, 1.0F}) {
            const Material material{"", coated(grey(1), alpha, eta)};
            const Bsdf bsdf = make_bsdf(material, flat_hit());
            for (const float theta : {0.0F, 45.0F, 70.0F, 85.0F, 89.0F, 89.94F}) {
                const RunningStats mean = mean_weight(bsdf, direction(theta), 40'000)[1];
                EXPECT_NEAR(mean.mean(), 1, 4 * mean.standard_error() + kTableError)
                    << eta << " " << alpha << " at " << theta;
            }
        }
    }
}

TEST(BsdfFurnace, GreyUnderVarnish_Smooth_IsTheSeriesOfBounces) {
    // Saunderson's correction: F + (1 - F) (1 - F') ρ/(1 - ρ F'), where F' is the coat's diffuse reflectance
    // from within; at normal incidence F = 0.04. For η = 1.5, F' = 0.5963 [Egan and Hilgeman 1979].
    const Material material{"", coated(grey(0.5F), 0)};
    const Rgb albedo = make_bsdf(material, flat_hit()).albedo(kUp);
    EXPECT_NEAR(albedo.x, 0.04 + 0.96 * (1 - 0.5963) * 0.5 / (1 - 0.5 * 0.5963), 5e-4);
}

TEST(BsdfFurnace, PerfectMetalUnderVarnish_Smooth_ReflectsAll) {
    ConductorMaterial perfect;
    perfect.eta = grey(0);  // no loss at any angle
    const Material material{"", CoatedConductorMaterial{varnish(1.5F, 0, 0), perfect}};
    const Bsdf bsdf = make_bsdf(material, flat_hit());
    for (const float theta : kAngles) EXPECT_NEAR(bsdf.albedo(direction(theta)).y, 1, 1e-5F) << theta;
}

TEST(BsdfFurnace, ClearPane_ReflectsTwiceAndPassesTheRest) {
    const Material material{"", ThinDielectricMaterial{}};
    const Bsdf bsdf = make_bsdf(material, flat_hit());
    EXPECT_TRUE(bsdf.is_delta());
    int back = 0;
    constexpr int kSteps = 10'000;
    for (int i = 0; i < kSteps; ++i) {
        const auto sample =
            bsdf.sample(kUp, {(static_cast<float>(i) + 0.5F) / kSteps, {0, 0}}, Transport::radiance);
        ASSERT_TRUE(sample && sample->delta);
        ASSERT_EQ(sample->weight, Rgb(1.0F));
        ASSERT_EQ(sample->wi, sample->transmission ? -kUp : kUp);
        back += sample->transmission ? 0 : 1;
    }
    EXPECT_NEAR(static_cast<double>(back) / kSteps, 2 * 0.04 / 1.04, 2e-4);
}

// --- Values of sums

TEST(BsdfSumValue, TwoLobes_Pdf_IsTheSumByChances) {
    const Material material{"", DiffuseTransmissionMaterial{grey(0.5F), grey(0.25F), 1}};
    const Bsdf bsdf = make_bsdf(material, flat_hit());
    const V3f wo = direction(30), wi = direction(50, 2);
    EXPECT_FLOAT_EQ(bsdf.pdf_w(wo, wi), 2.0F / 3 * wi.z / kPi);
    EXPECT_FLOAT_EQ(bsdf.pdf_w(wo, below(wi)), 1.0F / 3 * wi.z / kPi);
    EXPECT_FLOAT_EQ(bsdf.f(wo, wi, Transport::radiance).x, 0.5F / kPi);
    EXPECT_FLOAT_EQ(bsdf.f(wo, below(wi), Transport::radiance).x, 0.25F / kPi);
}

TEST(BsdfSumValue, DeltaBesideDiffuse_StaysOutOfDensityAndValue) {
    const std::array<Lobe, 2> lobes{MirrorLobe{Rgb(0.25F)}, DiffuseLobe{Rgb(0.75F)}};
    const Bsdf bsdf(lobes, kUp, kUp, kAlongX);
    EXPECT_FALSE(bsdf.is_delta());
    EXPECT_FALSE(bsdf.is_diffuse());
    EXPECT_TRUE(bsdf.rest().is_delta());
    const V3f wo = direction(30), mirror(-wo.x, -wo.y, wo.z);
    EXPECT_FLOAT_EQ(bsdf.f(wo, mirror, Transport::radiance).x, 0.75F / kPi);
    EXPECT_FLOAT_EQ(bsdf.pdf_w(wo, mirror), 0.75F * wo.z / kPi);
    const auto diffuse = bsdf.sample(wo, {0.3F, {0.3F, 0.7F}}, Transport::radiance);
    const auto delta = bsdf.sample(wo, {0.8F, {0.3F, 0.7F}}, Transport::radiance);
    ASSERT_TRUE(diffuse && delta);
    EXPECT_FALSE(diffuse->delta);
    EXPECT_NEAR(diffuse->weight.x, 1, 1e-5F);
    EXPECT_TRUE(delta->delta);
    EXPECT_EQ(delta->pdf_w, 0);
    EXPECT_NEAR(delta->weight.x, 1, 1e-5F) << "0.25 over the chance of 1/4";
}

TEST(BsdfSumValue, LambertianLobes_AddUpToOne) {
    const std::array<Lobe, 3> lobes{DiffuseLobe{Rgb(0.25F)}, BlackLobe{}, DiffuseLobe{Rgb(0.5F)}};
    const Bsdf bsdf(lobes, kUp, kUp, kAlongX);
    EXPECT_TRUE(bsdf.is_diffuse());
    EXPECT_EQ(bsdf.albedo(kUp), Rgb(0.75F));
    EXPECT_TRUE(Bsdf(std::span<const Lobe>{}, kUp, kUp, kAlongX).is_black());
}

TEST(BsdfSumValue, OrenNayar_IsPbrtsFormula) {
    const OrenNayarLobe lobe = oren_nayar(Rgb(0.5F), 0.5F);
    const Bsdf bsdf = flat(lobe);
    const double a = 1 - 0.25 / (2 * (0.25 + 0.33)), b = 0.45 * 0.25 / (0.25 + 0.09);
    const double low = 50 * std::numbers::pi / 180, high = 70 * std::numbers::pi / 180;
    const double f = 0.5 / std::numbers::pi * (a + b * std::cos(0.3) * std::sin(high) * std::tan(low));
    EXPECT_NEAR(bsdf.f(direction(50, 1), direction(70, 1.3F), Transport::radiance).x, f, 1e-6);
    EXPECT_EQ(oren_nayar(Rgb(0.5F), 0.5F).albedo, Rgb(0.5F)) << "dark enough to be left alone";
    EXPECT_LT(oren_nayar(Rgb(1.0F), 0.2F).albedo.x, 0.99F);
}

TEST(BsdfSumValue, DimPlastic_IsPbrtsSum) {
    const Material dim{"", uber(grey(0.5F), grey(0.4F), 0.2F, 0.2F)};
    const Bsdf bsdf = make_bsdf(dim, flat_hit());
    EXPECT_TRUE(bsdf.has_diffuse());
    EXPECT_EQ(bsdf.diffuse_part().albedo(kUp), Rgb(0.5F));
    const Material bright{"", uber(grey(0.7F), grey(0.4F), 0.2F, 0.2F)};
    const Bsdf covered = make_bsdf(bright, flat_hit());
    EXPECT_TRUE(covered.has_diffuse());
    EXPECT_FALSE(covered.diffuse_part().is_lambertian()) << "together 1.1: the base lies under a cover";
    EXPECT_LT(covered.diffuse_part().albedo(kUp).x, 0.7F);
}

}  // namespace bsdf_sums_test
}  // namespace lucerna
