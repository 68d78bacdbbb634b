#include "engine/world/bsdf.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/warp.h"
#include "engine/world/fresnel.h"
#include "engine/world/microfacet.h"

namespace lucerna {
namespace {

// A question to a lobe, in the shading frame mirrored so that the known direction's side of the surface is z
// > 0.
struct Local {
    V3f wo, wi;                 // by ns; wo.z may be <= 0 where the two normals disagree
    bool entering = true;       // wo lies outside (by ng)
    bool transmission = false;  // wi lies on the other side (by ng)
};

struct LocalSample {
    V3f wi;
    Rgb weight;
    float pdf_w = 0;
    bool delta = false;
    bool transmission = false;
    float eta_scale = 1;
};
using Draw = std::optional<LocalSample>;

// A rough lobe is not asked about directions closer to the horizon: the value of a pair of them grows as
// 1/cos and would leave float32's range. They carry next to nothing.
constexpr float kGrazing = 1e-12F;

bool is_smooth(float alpha_x, float alpha_y) {
    return std::max(alpha_x, alpha_y) < kSmoothAlpha;
}

template <typename Rough>
Ggx facets_of(const Rough& lobe) {
    return {std::max(lobe.alpha_x, kLeastAlpha), std::max(lobe.alpha_y, kLeastAlpha)};
}

V3f mirrored(const V3f& w) {
    return {-w.x, -w.y, w.z};
}
V3f reflected(const V3f& w, const V3f& m) {
    return 2 * w.dot(m) * m - w;
}

// --- Black
// -----------------------------------------------------------------------------------------------------

Rgb value(const BlackLobe&, const Local&, Transport) {
    return Rgb(0.0F);
}
float density(const BlackLobe&, const Local&) {
    return 0;
}
Draw draw(const BlackLobe&, const Local&, const BsdfU&, Transport) {
    return std::nullopt;
}
Rgb albedo_of(const BlackLobe&, const Local&) {
    return Rgb(0.0F);
}
bool is_delta_lobe(const BlackLobe&) {
    return false;
}

// --- Diffuse
// ---------------------------------------------------------------------------------------------------

// Only the light must stand above the shading horizon: were the eye to, silhouettes of smooth meshes would be
// black.
bool is_lit(const Local& at, Transport transport) {
    return (transport == Transport::radiance ? at.wi : at.wo).z >= 0;
}

Rgb value(const DiffuseLobe& lobe, const Local& at, Transport transport) {
    return at.transmission || !is_lit(at, transport) ? Rgb(0.0F) : lobe.albedo * kInvPi;
}
float density(const DiffuseLobe&, const Local& at) {
    return at.transmission ? 0.0F : cosine_hemisphere_pdf_w(at.wi.z);
}
Draw draw(const DiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    const V3f wi = square_to_cosine_hemisphere(u.direction);
    if (!(wi.z > 0) || (transport == Transport::particles && at.wo.z < 0)) return std::nullopt;
    return LocalSample{.wi = wi, .weight = lobe.albedo, .pdf_w = cosine_hemisphere_pdf_w(wi.z)};
}
Rgb albedo_of(const DiffuseLobe& lobe, const Local&) {
    return lobe.albedo;
}
bool is_delta_lobe(const DiffuseLobe&) {
    return false;
}

// --- Mirror
// ----------------------------------------------------------------------------------------------------

Rgb value(const MirrorLobe&, const Local&, Transport) {
    return Rgb(0.0F);
}
float density(const MirrorLobe&, const Local&) {
    return 0;
}
Draw draw(const MirrorLobe& lobe, const Local& at, const BsdfU&, Transport) {
    if (!(at.wo.z > 0)) return std::nullopt;
    return LocalSample{.wi = mirrored(at.wo), .weight = lobe.reflectance, .delta = true};
}
Rgb albedo_of(const MirrorLobe& lobe, const Local& at) {
    return at.wo.z > 0 ? lobe.reflectance : Rgb(0.0F);
}
bool is_delta_lobe(const MirrorLobe&) {
    return true;
}

// --- Conductor
// -------------------------------------------------------------------------------------------------

Rgb reflectance(const ConductorLobe& lobe, float cos_o) {
    return lobe.tint * fresnel_conductor(cos_o, lobe.eta, lobe.k);
}
bool is_delta_lobe(const ConductorLobe& lobe) {
    return is_smooth(lobe.alpha_x, lobe.alpha_y);
}
bool reflects_at_facets(const Local& at) {
    return !at.transmission && at.wo.z > kGrazing && at.wi.z > kGrazing;
}

// F D G2 / (4 cos_o cos_i) [Walter 2007 (20)].
Rgb value(const ConductorLobe& lobe, const Local& at, Transport) {
    if (is_delta_lobe(lobe) || !reflects_at_facets(at)) return Rgb(0.0F);
    const Ggx facets = facets_of(lobe);
    const V3f m = (at.wo + at.wi).normalized();  // not 0: both are above the horizon
    const float shape = facets.density(m) * facets.masking_shadowing_over_cos2(at.wo, at.wi) / 4;
    return reflectance(lobe, at.wo.dot(m)) * shape;
}
// The density of the facet, by dω_m = dω_i / (4 wo·m); wo·m cancels.
float density(const ConductorLobe& lobe, const Local& at) {
    if (is_delta_lobe(lobe) || !reflects_at_facets(at)) return 0;
    const Ggx facets = facets_of(lobe);
    return facets.masking_over_cos(at.wo) * facets.density((at.wo + at.wi).normalized()) / 4;
}
Draw draw(const ConductorLobe& lobe, const Local& at, const BsdfU& u, Transport) {
    if (!(at.wo.z > 0)) return std::nullopt;
    if (is_delta_lobe(lobe)) {
        return LocalSample{.wi = mirrored(at.wo), .weight = reflectance(lobe, at.wo.z), .delta = true};
    }
    const Ggx facets = facets_of(lobe);
    const V3f m = facets.sample_visible(at.wo, u.direction);
    Local to = at;
    to.wi = reflected(at.wo, m).normalized();
    const float pdf = density(lobe, to);
    if (!(pdf > 0))
        return std::nullopt;  // into the surface: a second bounce between facets, which is not modelled
    const Rgb weight = reflectance(lobe, at.wo.dot(m)) * facets.shadowing_if_visible(at.wo, to.wi);
    return LocalSample{.wi = to.wi, .weight = weight, .pdf_w = pdf};
}
Rgb albedo_of(const ConductorLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return Rgb(0.0F);
    if (is_delta_lobe(lobe)) return reflectance(lobe, at.wo.z);
    const Ggx facets = facets_of(lobe);
    return mean_over_visible(facets, at.wo, [&](const V3f& m) {
        const V3f wi = reflected(at.wo, m);
        if (!(wi.z > 0)) return Rgb(0.0F);
        return reflectance(lobe, at.wo.dot(m)) * facets.shadowing_if_visible(at.wo, wi);
    });
}

// --- Dielectric
// ------------------------------------------------------------------------------------------------

bool is_nothing(const DielectricLobe& lobe) {
    return lobe.eta == 1;
}
bool is_delta_lobe(const DielectricLobe& lobe) {
    return is_smooth(lobe.alpha_x, lobe.alpha_y) || std::fabs(lobe.eta - 1) < kLeastBend;
}

// Index on wi's side over the index on wo's, for transmission: η_i/η_o of the header.
float relative_eta(const DielectricLobe& lobe, const Local& at) {
    return at.entering ? lobe.eta : 1 / lobe.eta;
}

// What a facet of Fresnel reflectance F does: it reflects or transmits in proportion to what either carries
// at most.
struct Choice {
    float reflect, transmit;  // chances, of sum 1
    float carried;            // what both carry together, in (0,1]: the divisor of either
};
// Empty if neither carries anything.
std::optional<Choice> choice_of(const DielectricLobe& lobe, float fresnel) {
    const float r = fresnel * max_component(lobe.reflect);
    const float t = (1 - fresnel) * max_component(lobe.transmit);
    if (!(r + t > 0)) return std::nullopt;
    return Choice{r / (r + t), t / (r + t), r + t};
}

// The facet that turns wo into wi.
struct Facet {
    V3f m;               // m.z > 0, wo·m > 0
    float cos_o, cos_i;  // wo·m > 0, wi·m: > 0 for reflection, < 0 for transmission
    float bend;          // (wo·m + η wi·m)², transmission only
};
std::optional<Facet> facet_between(const Local& at, float eta) {
    if (!(at.wo.z > kGrazing) || !(std::fabs(at.wi.z) > kGrazing)) return std::nullopt;
    if (at.transmission != (at.wi.z < 0)) return std::nullopt;
    // [Walter 2007 (13), (16)]. The length of the sum is at least |1 - η|, far from 0 (kLeastBend).
    V3f m = at.transmission ? at.wo + eta * at.wi : at.wo + at.wi;
    const float bend = m.length2();
    m.normalize();
    if (m.z < 0) m = -m;
    const Facet facet{m, at.wo.dot(m), at.wi.dot(m), bend};
    // Facets that turn their back to either direction do not join the two.
    const bool seen = m.z > 0 && facet.cos_o > 0 && (at.transmission ? facet.cos_i < 0 : facet.cos_i > 0);
    return seen ? std::optional(facet) : std::nullopt;
}

Rgb value(const DielectricLobe& lobe, const Local& at, Transport transport) {
    if (is_delta_lobe(lobe)) return Rgb(0.0F);
    const float eta = relative_eta(lobe, at);
    const auto facet = facet_between(at, eta);
    if (!facet) return Rgb(0.0F);
    const Ggx facets = facets_of(lobe);
    const float fresnel = fresnel_dielectric(facet->cos_o, eta).reflectance;
    const float d = facets.density(facet->m);
    if (!at.transmission) {
        return lobe.reflect * (fresnel * d * facets.masking_shadowing_over_cos2(at.wo, at.wi) / 4);
    }
    // [Walter 2007 (21)] divided by η_o². The two sides of the surface mask independently (23).
    const float masking = facets.masking_over_cos(at.wo) * facets.masking_over_cos(at.wi);
    const float f = (1 - fresnel) * d * masking * facet->cos_o * -facet->cos_i / facet->bend;
    return lobe.transmit * (transport == Transport::radiance ? f : f * eta * eta);
}

float density(const DielectricLobe& lobe, const Local& at) {
    if (is_delta_lobe(lobe)) return 0;
    const float eta = relative_eta(lobe, at);
    const auto facet = facet_between(at, eta);
    if (!facet) return 0;
    const auto choice = choice_of(lobe, fresnel_dielectric(facet->cos_o, eta).reflectance);
    if (!choice) return 0;
    const Ggx facets = facets_of(lobe);
    if (!at.transmission)
        return choice->reflect * facets.masking_over_cos(at.wo) * facets.density(facet->m) / 4;
    // dω_m = η² |wi·m| / bend dω_i [Walter 2007 (17)].
    return choice->transmit * facets.visible_density(at.wo, facet->m) * eta * eta * -facet->cos_i /
           facet->bend;
}

// What a facet does to the light, shadowing aside. `cos_o` = wo·m > 0.
Draw draw_at_facet(const DielectricLobe& lobe, const Local& at, const V3f& m, float u, Transport transport) {
    const float eta = relative_eta(lobe, at);
    const float cos_o = at.wo.dot(m);
    const auto [fresnel, cos_t] = fresnel_dielectric(cos_o, eta);
    const auto choice = choice_of(lobe, fresnel);
    if (!choice) return std::nullopt;
    // F / chance and (1 - F) / chance, without the cancellation of 1 - F. Where a chance is not 0, neither is
    // its colour's largest component.
    if (u < choice->reflect) {
        const Rgb weight = lobe.reflect * (choice->carried / max_component(lobe.reflect));
        return LocalSample{.wi = reflected(at.wo, m), .weight = weight};
    }
    if (!(choice->transmit > 0)) return std::nullopt;  // u rounded to 1
    LocalSample sample{.wi = (cos_o * m - at.wo) / eta - cos_t * m,
                       .weight = lobe.transmit * (choice->carried / max_component(lobe.transmit)),
                       .transmission = true};
    if (transport == Transport::radiance) sample.eta_scale = 1 / (eta * eta);
    sample.weight *= sample.eta_scale;
    return sample;
}

Draw draw(const DielectricLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    if (is_nothing(lobe)) {
        return LocalSample{.wi = -at.wo, .weight = lobe.transmit, .delta = true, .transmission = true};
    }
    if (!(at.wo.z > 0)) return std::nullopt;
    if (is_delta_lobe(lobe)) {
        Draw sample = draw_at_facet(lobe, at, {0, 0, 1}, u.lobe, transport);
        if (sample) sample->delta = true;
        return sample;
    }
    const Ggx facets = facets_of(lobe);
    const V3f m = facets.sample_visible(at.wo, u.direction);
    if (!(at.wo.dot(m) > 0)) return std::nullopt;  // rounding, at grazing
    Draw sample = draw_at_facet(lobe, at, m, u.lobe, transport);
    if (!sample) return std::nullopt;
    sample->wi.normalize();
    Local to = at;
    to.wi = sample->wi;
    to.transmission = sample->transmission;
    sample->pdf_w = density(lobe, to);
    if (!(sample->pdf_w > 0)) return std::nullopt;  // to the wrong side of the surface: a second bounce
    sample->weight *= to.transmission ? facets.masking(to.wi) : facets.shadowing_if_visible(at.wo, to.wi);
    return sample;
}

Rgb albedo_of(const DielectricLobe& lobe, const Local& at) {
    if (is_nothing(lobe)) return lobe.transmit;
    if (!(at.wo.z > 0)) return Rgb(0.0F);
    const float eta = relative_eta(lobe, at);
    if (is_delta_lobe(lobe)) {
        const float fresnel = fresnel_dielectric(at.wo.z, eta).reflectance;
        return lobe.reflect * fresnel + lobe.transmit * (1 - fresnel);
    }
    const Ggx facets = facets_of(lobe);
    return mean_over_visible(facets, at.wo, [&](const V3f& m) {
        const float cos_o = at.wo.dot(m);
        if (!(cos_o > 0)) return Rgb(0.0F);
        const auto [fresnel, cos_t] = fresnel_dielectric(cos_o, eta);
        Rgb sum(0.0F);
        const V3f back = reflected(at.wo, m);
        if (back.z > 0) sum += lobe.reflect * (fresnel * facets.shadowing_if_visible(at.wo, back));
        const V3f through = (cos_o * m - at.wo) / eta - cos_t * m;
        if (fresnel < 1 && through.z < 0) sum += lobe.transmit * ((1 - fresnel) * facets.masking(through));
        return sum;
    });
}

// --- Parameters
// ------------------------------------------------------------------------------------------------

// Bilinear mixing of colours in [0,1] may round beyond 1.
[[maybe_unused]] bool is_share(const Rgb& c) {
    return std::min({c.x, c.y, c.z}) >= 0 && std::max({c.x, c.y, c.z}) <= 1 + 1e-5F;
}
[[maybe_unused]] bool is_alpha(float alpha) {
    return alpha >= 0 && std::isfinite(alpha);
}

[[maybe_unused]] bool is_sound(const BlackLobe&) {
    return true;
}
[[maybe_unused]] bool is_sound(const DiffuseLobe& lobe) {
    return is_share(lobe.albedo);
}
[[maybe_unused]] bool is_sound(const MirrorLobe& lobe) {
    return is_share(lobe.reflectance);
}
[[maybe_unused]] bool is_sound(const ConductorLobe& lobe) {
    const bool indices = std::min({lobe.eta.x, lobe.eta.y, lobe.eta.z, lobe.k.x, lobe.k.y, lobe.k.z}) >= 0 &&
                         is_finite(lobe.eta) && is_finite(lobe.k);
    return indices && is_share(lobe.tint) && is_alpha(lobe.alpha_x) && is_alpha(lobe.alpha_y);
}
[[maybe_unused]] bool is_sound(const DielectricLobe& lobe) {
    return lobe.eta > 0 && std::isfinite(lobe.eta) && is_share(lobe.reflect) && is_share(lobe.transmit) &&
           is_alpha(lobe.alpha_x) && is_alpha(lobe.alpha_y);
}

// The frame about ns whose s lies along dpdu; any frame where dpdu says nothing across ns.
Frame frame_along(const V3f& ns, const V3f& dpdu) {
    const V3f across = dpdu - ns.dot(dpdu) * ns;
    const float length = across.length();
    Frame frame(ns);
    if (length > 1e-6F * dpdu.length() && std::isfinite(length)) {
        frame.s = across / length;
        frame.t = ns.cross(frame.s);
    }
    return frame;
}

V3f to_local(const Frame& frame, const V3f& w, float side) {
    const V3f v = frame.to_local(w);
    return {v.x, v.y, side * v.z};
}

// +1 outside, -1 inside; a direction within the surface counts as outside.
float side_of(const V3f& ng, const V3f& wo) {
    return ng.dot(wo) >= 0 ? 1.0F : -1.0F;
}

}  // namespace

Bsdf::Bsdf(const Lobe& lobe, const V3f& ns, const V3f& ng, const V3f& dpdu)
    : lobe_(lobe), frame_(frame_along(ns, dpdu)), ng_(ng) {
    assert(std::visit([](const auto& l) { return is_sound(l); }, lobe_));
}

Rgb Bsdf::f(const V3f& wo, const V3f& wi, Transport transport) const {
    const float side = side_of(ng_, wo);
    const float cos_g = side * ng_.dot(wi);
    if (cos_g == 0) return Rgb(0.0F);  // within the surface: on neither side
    const Local at{to_local(frame_, wo, side), to_local(frame_, wi, side), side > 0, cos_g < 0};
    return std::visit([&](const auto& lobe) { return value(lobe, at, transport); }, lobe_);
}

float Bsdf::pdf_w(const V3f& wo, const V3f& wi) const {
    const float side = side_of(ng_, wo);
    const float cos_g = side * ng_.dot(wi);
    if (cos_g == 0) return 0;
    const Local at{to_local(frame_, wo, side), to_local(frame_, wi, side), side > 0, cos_g < 0};
    return std::visit([&](const auto& lobe) { return density(lobe, at); }, lobe_);
}

std::optional<BsdfSample> Bsdf::sample(const V3f& wo, const BsdfU& u, Transport transport) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    const Draw drawn = std::visit([&](const auto& lobe) { return draw(lobe, at, u, transport); }, lobe_);
    if (!drawn) return std::nullopt;
    BsdfSample sample{-wo, drawn->weight, drawn->pdf_w, drawn->delta, drawn->transmission, drawn->eta_scale};
    const auto* glass = std::get_if<DielectricLobe>(&lobe_);
    if (glass && is_nothing(*glass)) return sample;  // exactly straight on, also along the surface
    sample.wi = frame_.to_world({drawn->wi.x, drawn->wi.y, side * drawn->wi.z}).normalized();
    // Both normals must agree on the side, or light would leak.
    const float cos_g = side * ng_.dot(sample.wi);
    if (cos_g == 0 || sample.transmission != (cos_g < 0)) return std::nullopt;
    return sample;
}

Rgb Bsdf::albedo(const V3f& wo) const {
    const float side = side_of(ng_, wo);
    const Local at{to_local(frame_, wo, side), V3f(0.0F), side > 0, false};
    return std::visit([&](const auto& lobe) { return albedo_of(lobe, at); }, lobe_);
}

bool Bsdf::is_delta() const {
    return std::visit([](const auto& lobe) { return is_delta_lobe(lobe); }, lobe_);
}

}  // namespace lucerna
