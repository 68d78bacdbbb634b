// Scattering where it could go wrong: bent normals, grazing directions, extreme parameters.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/coat.h"
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
// -----------------------------------------------------------------------------------------------------

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
    const V3f eye = direction(45, kPi);  // above ng's horizon, below that of ns
    ASSERT_LT(eye.dot(ns), 0);
    const Bsdf bsdf(DiffuseLobe{Rgb(0.5F)}, ns, kUp, kAlongX);
    EXPECT_FLOAT_EQ(bsdf.f(eye, kUp, Transport::radiance).x, 0.5F / kPi);
    EXPECT_TRUE(is_black(bsdf.f(kUp, eye, Transport::radiance)));  // but light from there does not count
    EXPECT_FLOAT_EQ(bsdf.f(kUp, eye, Transport::particles).x, 0.5F / kPi);
    EXPECT_FALSE(bsdf.sample(eye, {0, {0.2F, 0.3F}}, Transport::particles));
    EXPECT_TRUE(bsdf.sample(eye, {0, {0.6F, 0.5F}}, Transport::radiance));
}

// --- Edges
// -----------------------------------------------------------------------------------------------------

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
    // The chance of transmission is of the order of u's last bit.
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

// Random unit numbers with a liking for the edges.
rc::Gen<float> unit() {
    return rc::gen::weightedOneOf<float>({{6, rc::gen::map(rc::gen::arbitrary<std::uint32_t>(), to_unit)},
                                          {2, rc::gen::element(0.0F, 0x1p-24F, 0.5F, 1 - 0x1p-24F)}});
}
rc::Gen<V3f> any_direction() {
    return rc::gen::apply(
        [](float a, float phi, float sign, float edge) {
            float z = edge < 0.3F ? std::pow(10.0F, -40 * a) : a;
            if (edge > 0.9F) z = std::round(a);
            const float s = std::sqrt(std::max(0.0F, 1 - z * z));
            return V3f(s * std::cos(6.2831853F * phi), s * std::sin(6.2831853F * phi), sign < 0.5F ? z : -z);
        },
        unit(), unit(), unit(), unit());
}
rc::Gen<float> any_alpha() {
    return rc::gen::oneOf(rc::gen::element(0.0F, 1e-30F, 1e-4F, 0.001F, 0.0011F, 1.0F, 2.0F), unit());
}
rc::Gen<float> any_eta() {
    return rc::gen::oneOf(rc::gen::element(0.01F, 0.999F, 1.0F, 1.0000001F, 1.001F, 1.0011F, 1.5F, 100.0F),
                          rc::gen::map(unit(), [](float x) { return 0.3F + 2 * x; }));
}
rc::Gen<Lobe> any_lobe() {
    const auto color =
        rc::gen::apply([](float r, float g, float b) { return Rgb(r, g, b); }, unit(), unit(), unit());
    return rc::gen::oneOf(rc::gen::map(color, [](const Rgb& c) { return Lobe(DiffuseLobe{c}); }),
                          rc::gen::map(color, [](const Rgb& c) { return Lobe(MirrorLobe{c}); }),
                          rc::gen::map(color, [](const Rgb& c) { return Lobe(DiffuseTransmitLobe{c}); }),
                          rc::gen::apply(
                              [](float eta, const Rgb& c) {
                                  return Lobe(ThinDielectricLobe{eta, c});
                              },
                              any_eta(), color),
                          rc::gen::apply(
                              [](float eta, const Rgb& c, float ax, float ay) {
                                  return Lobe(GlossLobe{eta, c, ax, ay});
                              },
                              any_eta(), color, any_alpha(), any_alpha()),
                          rc::gen::apply(
                              [](const Rgb& n, const Rgb& k, const Rgb& t, float ax, float ay) {
                                  return Lobe(ConductorLobe{n * 3, k * 10, t, ax, ay});
                              },
                              color, color, color, any_alpha(), any_alpha()),
                          rc::gen::apply(
                              [](float eta, const Rgb& r, const Rgb& t, float ax, float ay) {
                                  return Lobe(DielectricLobe{eta, r, t, ax, ay});
                              },
                              any_eta(), color, color, any_alpha(), any_alpha()));
}

RC_GTEST_PROP(BsdfProperties, AnyLobeAnyDirections_NeverNanNeverMoreThanOne, ()) {
    const Lobe lobe = *any_lobe();
    const V3f ng = (*any_direction()).normalized();
    V3f ns = *rc::gen::oneOf(rc::gen::just(ng), any_direction());
    if (ns.dot(ng) < 0) ns = -ns;
    const Bsdf bsdf(lobe, ns.normalized(), ng, *any_direction());
    const V3f wo = *any_direction();
    const V3f wi = *any_direction();
    const BsdfU u{*unit(), {*unit(), *unit()}};
    for (const Transport transport : {Transport::radiance, Transport::particles}) {
        const Rgb f = bsdf.f(wo, wi, transport);
        RC_ASSERT(is_finite(f) && f.x >= 0 && f.y >= 0 && f.z >= 0);
        const auto sample = bsdf.sample(wo, u, transport);
        if (!sample) continue;
        RC_ASSERT(is_finite(sample->wi) && std::fabs(sample->wi.length() - 1) < 1e-5F);
        RC_ASSERT(is_finite(sample->weight) && std::isfinite(sample->pdf_w));
        RC_ASSERT(sample->delta == !(sample->pdf_w > 0));
        const Rgb without_eta = sample->weight / sample->eta_scale;
        RC_ASSERT(max_component(without_eta) <= 1.00001F);
    }
    const float pdf = bsdf.pdf_w(wo, wi);
    RC_ASSERT(std::isfinite(pdf) && pdf >= 0);
    const Rgb albedo = bsdf.albedo(wo);
    RC_ASSERT(std::min({albedo.x, albedo.y, albedo.z}) >= 0);
    RC_ASSERT(max_component(albedo) <= 1);
}

const CoatTable& any_varnish() {
    static const CoatTable table(1.5F);
    return table;
}
// Those whose samples may weigh more than 1 where the mean does not.
rc::Gen<Lobe> any_uneven_lobe() {
    const auto color =
        rc::gen::apply([](float r, float g, float b) { return Rgb(r, g, b); }, unit(), unit(), unit());
    return rc::gen::oneOf(
        rc::gen::apply([](const Rgb& c, float sigma) { return Lobe(oren_nayar(c, sigma)); }, color, unit()),
        rc::gen::apply(
            [](const Rgb& d, const Rgb& s) {
                return Lobe(SubstrateBaseLobe{d, s});
            },
            color, color),
        rc::gen::apply(
            [](const Rgb& s, float ax, float ay) {
                return Lobe(SubstrateGlossLobe{s, ax, ay});
            },
            color, unit(), unit()),
        rc::gen::apply(
            [](const Rgb& c, const Rgb& g, float alpha) {
                return Lobe(CoveredDiffuseLobe{c, {&any_varnish(), alpha, g / 2, g / 2, g / 2}});
            },
            color, color, any_alpha()),
        rc::gen::apply(
            [](const Rgb& n, const Rgb& k, const Rgb& t, float alpha, float coat) {
                return Lobe(CoatedConductorLobe{n * 3, k * 10, t, 1.5F, coat, &any_varnish(), alpha, alpha});
            },
            color, color, color, any_alpha(), any_alpha()));
}

RC_GTEST_PROP(BsdfProperties, AnySumAnyDirections_NeverNanNeverOnTheWrongSide, ()) {
    const auto lobes = *rc::gen::container<std::vector<Lobe>>(
        static_cast<std::size_t>(*rc::gen::inRange(0, 6)), rc::gen::oneOf(any_lobe(), any_uneven_lobe()));
    const V3f ng = (*any_direction()).normalized();
    V3f ns = *rc::gen::oneOf(rc::gen::just(ng), any_direction());
    if (ns.dot(ng) < 0) ns = -ns;
    const Bsdf bsdf(lobes, ns.normalized(), ng, *any_direction());
    const V3f wo = *any_direction();
    const V3f wi = *any_direction();
    const BsdfU u{*unit(), {*unit(), *unit()}};
    for (const Transport transport : {Transport::radiance, Transport::particles}) {
        const Rgb f = bsdf.f(wo, wi, transport);
        RC_ASSERT(is_finite(f) && f.x >= 0 && f.y >= 0 && f.z >= 0);
        const auto sample = bsdf.sample(wo, u, transport);
        if (!sample) continue;
        RC_ASSERT(is_finite(sample->wi) && std::fabs(sample->wi.length() - 1) < 1e-5F);
        RC_ASSERT(is_finite(sample->weight) && std::isfinite(sample->pdf_w));
        RC_ASSERT(sample->delta == !(sample->pdf_w > 0));
        RC_ASSERT(sample->eta_scale > 0);
        const float sides = sample->wi.dot(ng) * wo.dot(ng);
        RC_ASSERT((sample->transmission ? sides <= 0 : sides >= 0));
    }
    const float pdf = bsdf.pdf_w(wo, wi);
    RC_ASSERT(std::isfinite(pdf) && pdf >= 0);
    const Rgb albedo = bsdf.albedo(wo);
    RC_ASSERT(std::min({albedo.x, albedo.y, albedo.z}) >= 0);
    RC_ASSERT(max_component(albedo) <= 1);
    RC_ASSERT(bsdf.has_diffuse() == bsdf.diffuse_part().is_diffuse());
    RC_ASSERT(!bsdf.rest().has_diffuse());
}

}  // namespace bsdf_limits_test
}  // namespace lucerna
