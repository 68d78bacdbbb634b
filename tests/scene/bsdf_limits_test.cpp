// Scattering in difficult cases: bent normals, grazing directions, extreme parameters.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/fresnel.h"
#include "tests/support/lobes.h"

namespace lucerna {
namespace bsdf_limits_test {

using testing::direction;
using testing::flat;
using testing::glass;
using testing::kAlongX;
using testing::kUp;
using testing::metal;
using testing::tilted;

// --- Sides

TEST(BsdfSides, BentNormals_NoLobe_LeaksLight) {
    const V3f ns = tilted(50);
    Sampler sampler(17, Purpose::test, 0, 0);
    for (const Lobe& lobe :
         {Lobe(DiffuseLobe{Rgb(1.0F)}), Lobe(MirrorLobe{Rgb(1.0F)}), Lobe(metal(0.3F, 0.3F))}) {
        const Bsdf bsdf(lobe, ns, kUp, kAlongX);
        for (int i = 0; i < 5000; ++i) {
            const V3f wo = direction(180 * sampler.next(), 6.28F * sampler.next());
            const V3f wi = direction(180 * sampler.next(), 6.28F * sampler.next());
            if (wo.z * wi.z < 0) {
                ASSERT_TRUE(is_black(bsdf.f(wo, wi, Transport::radiance))) << wo << wi;
                ASSERT_EQ(bsdf.pdf_w(wo, wi), 0) << wo << wi;
            }
            const auto sample = bsdf.sample(wo, {sampler.next(), sampler.next2()}, Transport::radiance);
            ASSERT_TRUE(!sample || sample->wi.z * wo.z > 0) << wo << sample->wi;
        }
    }
}

TEST(BsdfSides, Diffuse_EyeBelowTheShadingHorizon_IsStillLit) {
    const V3f ns = direction(60, 0);
    const V3f eye = direction(45, kPi);  // above the horizon of ng, below that of ns
    ASSERT_LT(eye.dot(ns), 0);
    const Bsdf bsdf(DiffuseLobe{Rgb(0.5F)}, ns, kUp, kAlongX);
    EXPECT_FLOAT_EQ(bsdf.f(eye, kUp, Transport::radiance).x, 0.5F / kPi);
    EXPECT_TRUE(is_black(bsdf.f(kUp, eye, Transport::radiance)));  // light from there does not count
    EXPECT_FLOAT_EQ(bsdf.f(kUp, eye, Transport::particles).x, 0.5F / kPi);
    EXPECT_FALSE(bsdf.sample(eye, {0, {0.2F, 0.3F}}, Transport::particles));
    EXPECT_TRUE(bsdf.sample(eye, {0, {0.6F, 0.5F}}, Transport::radiance));
}

// --- Edges

TEST(BsdfEdges, CosineExactlyZero_AnyLobe_IsFinite) {
    const V3f edge(1, 0, 0);
    for (const Lobe& lobe :
         {Lobe(DiffuseLobe{Rgb(0.5F)}), Lobe(MirrorLobe{Rgb(1.0F)}), Lobe(metal(0, 0)), Lobe(metal(1, 1)),
          Lobe(glass(1.5F, 0, 0)), Lobe(glass(1.5F, 0.3F, 0.3F)), Lobe(BlackLobe{})}) {
        const Bsdf bsdf = flat(lobe);
        for (const V3f& wi : {kUp, -kUp, edge, -edge}) {
            EXPECT_TRUE(is_finite(bsdf.f(edge, wi, Transport::radiance)));
            EXPECT_TRUE(is_finite(bsdf.f(wi, edge, Transport::radiance)));
            EXPECT_TRUE(std::isfinite(bsdf.pdf_w(edge, wi)) && std::isfinite(bsdf.pdf_w(wi, edge)));
        }
        const auto sample = bsdf.sample(edge, {0.5F, {0.5F, 0.2F}}, Transport::radiance);
        EXPECT_EQ(sample.has_value(), bsdf.is_diffuse());
        EXPECT_TRUE(is_finite(bsdf.albedo(edge)));
    }
}

TEST(BsdfEdges, BothDirectionsAlmostWithinTheSurface_ValueIsFinite) {
    for (const float z : {1e-45F, 1e-40F, 1e-20F, 1e-13F, 1e-10F}) {
        const V3f wo(1, 0, z);
        for (const Lobe& lobe : {Lobe(metal(1e-4F, 0.5F)), Lobe(glass(1.5F, 1e-4F, 0.5F))}) {
            for (const V3f& wi : {V3f(-1, 0, z), V3f(1, 0, z), V3f(-1, 0, -z)}) {
                EXPECT_TRUE(is_finite(flat(lobe).f(wo, wi, Transport::radiance))) << z;
                EXPECT_TRUE(std::isfinite(flat(lobe).pdf_w(wo, wi))) << z;
            }
        }
    }
}

TEST(BsdfEdges, AlmostTotalReflection_RareTransmission_WeighsNoMoreThanOne) {
    // The probability of transmission is of the order of u's last bit.
    for (float eta = 1.0001F; eta < 1e7F; eta *= 1.7F) {
        for (const float z : {1.0F, 1e-2F, 1e-5F, 1e-7F}) {
            const V3f wo(std::sqrt(1 - z * z), 0, z);
            for (const V3f& from : {wo, -wo}) {
                const auto sample =
                    flat(glass(eta, 0, 0)).sample(from, {1 - 0x1p-24F, {0, 0}}, Transport::particles);
                EXPECT_LE(sample ? max_component(sample->weight) : 0, 1.00001F) << eta << " " << z;
            }
        }
    }
}

TEST(BsdfEdges, Black_Anything_ScattersNothing) {
    const Bsdf bsdf = flat(BlackLobe{});
    EXPECT_TRUE(bsdf.is_black());
    EXPECT_FALSE(bsdf.is_delta());
    EXPECT_FALSE(bsdf.sample(kUp, {0, {0, 0}}, Transport::radiance));
    EXPECT_TRUE(is_black(bsdf.albedo(kUp)));
}

TEST(BsdfEdges, GlassWithoutTransmission_NeverSamplesIt) {
    const Bsdf bsdf = flat(DielectricLobe{1.5F, Rgb(1.0F), Rgb(0.0F), 0.2F, 0.2F});
    const Bsdf nothing = flat(DielectricLobe{1.5F, Rgb(0.0F), Rgb(0.0F), 0.2F, 0.2F});
    Sampler sampler(18, Purpose::test, 0, 0);
    for (int i = 0; i < 1000; ++i) {
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = bsdf.sample(direction(50), u, Transport::radiance);
        EXPECT_TRUE(!sample || !sample->transmission);
        EXPECT_FALSE(nothing.sample(direction(50), u, Transport::radiance));
    }
}

// The following functions draw random values when they are called, within a property. unit() returns a random
// number in [0, 1), often one of its extremes.
float unit() {
    if (*rc::gen::element(true, false, false, false))
        return *rc::gen::element(0.0F, 0x1p-24F, 0.5F, 1 - 0x1p-24F);
    return to_unit(*rc::gen::arbitrary<std::uint32_t>());
}
V3f any_direction() {
    const float a = unit(), phi = unit(), sign = unit(), edge = unit();
    float z = edge < 0.3F ? std::pow(10.0F, -40 * a) : a;
    if (edge > 0.9F) z = std::round(a);
    const float s = std::sqrt(std::max(0.0F, 1 - z * z));
    return {s * std::cos(6.2831853F * phi), s * std::sin(6.2831853F * phi), sign < 0.5F ? z : -z};
}
float any_alpha() {
    if (*rc::gen::arbitrary<bool>()) return unit();
    return *rc::gen::element(0.0F, 1e-30F, 1e-4F, 0.001F, 0.0011F, 1.0F, 2.0F);
}
float any_eta() {
    if (*rc::gen::arbitrary<bool>()) return 0.3F + 2 * unit();
    return *rc::gen::element(0.01F, 0.999F, 1.0F, 1.0000001F, 1.001F, 1.0011F, 1.5F, 100.0F);
}
Rgb any_color() {
    return Rgb{unit(), unit(), unit()};
}
BsdfU any_u() {
    return {unit(), {unit(), unit()}};
}

Lobe any_lobe() {
    switch (*rc::gen::element(0, 1, 2, 3, 4, 5, 6)) {
        case 0:
            return DiffuseLobe{any_color()};
        case 1:
            return MirrorLobe{any_color()};
        case 2:
            return DiffuseTransmitLobe{any_color()};
        case 3:
            return ThinDielectricLobe{any_eta(), any_color()};
        case 4:
            return GlossLobe{any_eta(), any_color(), any_alpha(), any_alpha()};
        case 5:
            return ConductorLobe{any_color() * 3, any_color() * 10, any_color(), any_alpha(), any_alpha()};
        default:
            return DielectricLobe{any_eta(), any_color(), any_color(), any_alpha(), any_alpha()};
    }
}

// Returns a Bsdf of these lobes, with normals that may or may not agree.
template <typename Lobes>
Bsdf any_bsdf(const Lobes& lobes) {
    const V3f ng = any_direction().normalized();
    const V3f ns = *rc::gen::arbitrary<bool>() ? ng : any_direction();
    return Bsdf(lobes, face_forward(ns, ng).normalized(), ng, any_direction());
}
// Evaluates two arbitrary directions: all results are finite, and densities, values and albedos are not
// negative. Samples are passed to check(sample, wo), too.
template <typename Check>
void ask_anything(const Bsdf& bsdf, Check&& check) {
    const V3f wo = any_direction();
    const V3f wi = any_direction();
    const BsdfU u = any_u();
    for (const Transport transport : {Transport::radiance, Transport::particles}) {
        const Rgb f = bsdf.f(wo, wi, transport);
        RC_ASSERT(is_finite(f) && f.x >= 0 && f.y >= 0 && f.z >= 0);
        const auto sample = bsdf.sample(wo, u, transport);
        if (!sample) continue;
        RC_ASSERT(is_finite(sample->wi) && std::fabs(sample->wi.length() - 1) < 1e-5F);
        RC_ASSERT(is_finite(sample->weight) && std::isfinite(sample->pdf_w));
        RC_ASSERT(sample->delta == !(sample->pdf_w > 0));
        check(*sample, wo);
    }
    const float pdf = bsdf.pdf_w(wo, wi);
    RC_ASSERT(std::isfinite(pdf) && pdf >= 0);
    const Rgb albedo = bsdf.albedo(wo);
    RC_ASSERT(std::min({albedo.x, albedo.y, albedo.z}) >= 0);
    // Lambertian lobes are merged into one; their caller keeps their sum below 1.
    RC_ASSERT(bsdf.is_lambertian() || max_component(albedo) <= 1);
}

RC_GTEST_PROP(BsdfProperties, AnyLobeAnyDirections_NeverNanNeverMoreThanOne, ()) {
    ask_anything(any_bsdf(any_lobe()), [](const BsdfSample& sample, const V3f& /*wo*/) {
        const Rgb without_eta = sample.weight / sample.eta_scale;
        RC_ASSERT(max_component(without_eta) <= 1.00001F);
    });
}

const CoatTable& any_varnish() {
    static const CoatTable table(1.5F);
    return table;
}
// Returns a lobe whose samples may weigh more than 1 although their mean does not.
Lobe any_uneven_lobe() {
    switch (*rc::gen::element(0, 1, 2, 3, 4)) {
        case 0: {
            const Rgb color = any_color();
            return oren_nayar(color, unit());
        }
        case 1:
            return SubstrateBaseLobe{any_color(), any_color()};
        case 2:
            return SubstrateGlossLobe{any_color(), unit(), unit()};
        case 3: {
            const Rgb color = any_color(), cover = any_color() / 2;
            return CoveredDiffuseLobe{color, {&any_varnish(), any_alpha(), cover, cover, cover}};
        }
        default: {
            const Rgb eta = any_color() * 3, k = any_color() * 10, tint = any_color();
            const float alpha = any_alpha();
            return CoatedConductorLobe{eta, k, tint, 1.5F, any_alpha(), &any_varnish(), alpha, alpha};
        }
    }
}

RC_GTEST_PROP(BsdfProperties, AnySumAnyDirections_NeverNanNeverOnTheWrongSide, ()) {
    std::vector<Lobe> lobes;
    for (int left = *rc::gen::inRange(0, 6); left > 0; --left) {
        lobes.push_back(*rc::gen::arbitrary<bool>() ? any_lobe() : any_uneven_lobe());
    }
    const Bsdf bsdf = any_bsdf(lobes);
    ask_anything(bsdf, [&](const BsdfSample& sample, const V3f& wo) {
        RC_ASSERT(sample.eta_scale > 0);
        const V3f ng = bsdf.geometric_normal();
        const float sides = sample.wi.dot(ng) * wo.dot(ng);
        RC_ASSERT((sample.transmission ? sides <= 0 : sides >= 0));
    });
    RC_ASSERT(bsdf.has_diffuse() == bsdf.diffuse_part().is_diffuse());
    RC_ASSERT(!bsdf.rest().has_diffuse());
}

}  // namespace bsdf_limits_test
}  // namespace lucerna
