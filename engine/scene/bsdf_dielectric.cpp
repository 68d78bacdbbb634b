// Implements the lobes of glass: one boundary, or a pane.
#include "engine/scene/fresnel.h"
#include "engine/scene/lobe_models.h"

namespace lucerna {
namespace {

bool is_nothing(const DielectricLobe& lobe) {
    return lobe.eta == 1;
}

// Returns the index on wi's side over the index on wo's side for transmission, η_i/η_o of bsdf.h.
float relative_eta(const DielectricLobe& lobe, const Local& at) {
    return at.entering ? lobe.eta : 1 / lobe.eta;
}

// Describes what a facet of Fresnel reflectance F does. It reflects or transmits in proportion to the largest
// channel that each carries.
struct Choice {
    float reflect, transmit;  // probabilities that add up to 1
    float carried;            // the sum of both shares, in (0,1], by which either is divided
};
// Returns none if neither carries anything.
std::optional<Choice> choice_of(const DielectricLobe& lobe, float fresnel) {
    const float r = fresnel * max_component(lobe.reflect);
    const float t = (1 - fresnel) * max_component(lobe.transmit);
    if (!(r + t > 0)) return std::nullopt;
    return Choice{r / (r + t), t / (r + t), r + t};
}

// Describes the facet that turns wo into wi.
struct Facet {
    V3f m;               // m.z > 0, wo·m > 0
    float cos_o, cos_i;  // wo·m > 0, wi·m: > 0 for reflection, < 0 for transmission
    float bend;          // (wo·m + η wi·m)², transmission only
};
std::optional<Facet> facet_between(const Local& at, float eta) {
    if (!(at.wo.z > kGrazingCos) || !(std::fabs(at.wi.z) > kGrazingCos)) return std::nullopt;
    if (at.transmission != (at.wi.z < 0)) return std::nullopt;
    // The facet is by [Walter 2007, (13), (16)]. The length of the sum is at least |1 - η|, which kLeastBend
    // keeps from 0.
    V3f m = at.transmission ? at.wo + eta * at.wi : at.wo + at.wi;
    const float bend = m.length2();
    m.normalize();
    if (m.z < 0) m = -m;
    const Facet facet{m, at.wo.dot(m), at.wi.dot(m), bend};
    // A facet that faces away from either direction cannot join the two.
    const bool seen = m.z > 0 && facet.cos_o > 0 && (at.transmission ? facet.cos_i < 0 : facet.cos_i > 0);
    return seen ? std::optional(facet) : std::nullopt;
}

}  // namespace

bool is_delta_lobe(const DielectricLobe& lobe) {
    return is_smooth(lobe.alpha_x, lobe.alpha_y) || std::fabs(lobe.eta - 1) < kLeastBend;
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
    // This is [Walter 2007, (21)] divided by η_o². The two sides of the surface mask independently (23).
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
    // The Jacobian is dω_m = η² |wi·m| / bend dω_i [Walter 2007, (17)].
    return choice->transmit * facets.visible_density(at.wo, facet->m) * eta * eta * -facet->cos_i /
           facet->bend;
}

namespace {

// Draws reflection or transmission at facet m, without shadowing. `cos_o` = wo·m > 0.
Draw draw_at_facet(const DielectricLobe& lobe, const Local& at, const V3f& m, float u, Transport transport) {
    const float eta = relative_eta(lobe, at);
    const float cos_o = at.wo.dot(m);
    const auto [fresnel, cos_t] = fresnel_dielectric(cos_o, eta);
    const auto choice = choice_of(lobe, fresnel);
    if (!choice) return std::nullopt;
    // The weights are F / probability and (1 - F) / probability, without the cancellation of 1 - F. Where a
    // probability is not 0, its colour's largest component is not 0 either.
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

}  // namespace

Draw draw(const DielectricLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    if (is_nothing(lobe)) {
        return LocalSample{
            .wi = -at.wo, .weight = lobe.transmit, .delta = true, .transmission = true, .straight = true};
    }
    if (!(at.wo.z > 0)) return std::nullopt;
    if (is_delta_lobe(lobe)) {
        Draw sample = draw_at_facet(lobe, at, {0, 0, 1}, u.lobe, transport);
        if (sample) sample->delta = true;
        return sample;
    }
    const Ggx facets = facets_of(lobe);
    const V3f m = facets.sample_visible(at.wo, u.direction);
    if (!(at.wo.dot(m) > 0)) return std::nullopt;  // may fail by rounding at grazing angles
    Draw sample = draw_at_facet(lobe, at, m, u.lobe, transport);
    if (!sample) return std::nullopt;
    sample->wi.normalize();
    Local to = at;
    to.wi = sample->wi;
    to.transmission = sample->transmission;
    sample->pdf_w = density(lobe, to);
    if (!(sample->pdf_w > 0)) return std::nullopt;  // a second bounce, which is not modelled
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
float chance_of(const DielectricLobe& lobe, const Local& at) {
    if (is_nothing(lobe)) return max_component(lobe.transmit);
    if (!(at.wo.z > 0)) return 0;
    const float fresnel = fresnel_dielectric(at.wo.z, relative_eta(lobe, at)).reflectance;
    const float r = max_component(lobe.reflect), t = max_component(lobe.transmit);
    return std::max(fresnel * r + (1 - fresnel) * t, is_delta_lobe(lobe) ? 0 : kLeastChance * std::max(r, t));
}
std::optional<float> reflect_chance_of(const DielectricLobe& lobe, const Local& at) {
    if (is_nothing(lobe) || !is_delta_lobe(lobe) || !(at.wo.z > 0)) return std::nullopt;
    const auto choice = choice_of(lobe, fresnel_dielectric(at.wo.z, relative_eta(lobe, at)).reflectance);
    return choice ? std::optional(choice->reflect) : std::nullopt;
}
Rgb straight_share_of(const DielectricLobe& lobe, const Local& /*at*/) {
    return is_nothing(lobe) ? lobe.transmit : Rgb(0.0F);
}
bool is_sound(const DielectricLobe& lobe) {
    return lobe.eta > 0 && std::isfinite(lobe.eta) && is_share(lobe.reflect) && is_share(lobe.transmit) &&
           is_alpha(lobe.alpha_x) && is_alpha(lobe.alpha_y);
}

// --- A pane

namespace {

struct PaneShares {
    float reflected, transmitted;
};

// Returns the shares with all bounces between the faces. With the reflectance F of a face and the
// transmittance t between them, the transmitted share is (1 - F)² t (1 + F² t² + F⁴ t⁴ + ...).
PaneShares pane_shares(const ThinDielectricLobe& lobe, float cos_o) {
    const auto [f, cos_t] = fresnel_dielectric(cos_o, lobe.eta);
    if (lobe.inside == 1 || !(cos_t > 0)) {
        const float reflected = 2 * f / (1 + f);
        return {reflected, 1 - reflected};
    }
    const float t = pow(lobe.inside, 1 / cos_t);
    const float passed = sqr(1 - f) * t / (1 - sqr(f * t));
    return {f + f * t * passed, passed};
}

// Returns the probability of reflection; `shares` are not both 0.
float reflect_chance_of(const PaneShares& shares) {
    return shares.reflected / (shares.reflected + shares.transmitted);
}

}  // namespace

Rgb value(const ThinDielectricLobe&, const Local&, Transport) {
    return Rgb(0.0F);
}
float density(const ThinDielectricLobe&, const Local&) {
    return 0;
}
Draw draw(const ThinDielectricLobe& lobe, const Local& at, const BsdfU& u, Transport) {
    if (!(at.wo.z > 0)) return std::nullopt;
    const PaneShares shares = pane_shares(lobe, at.wo.z);
    const Rgb weight = lobe.tint * (shares.reflected + shares.transmitted);
    if (u.lobe < reflect_chance_of(shares))
        return LocalSample{.wi = mirrored(at.wo), .weight = weight, .delta = true};
    return LocalSample{.wi = -at.wo, .weight = weight, .delta = true, .transmission = true, .straight = true};
}
Rgb albedo_of(const ThinDielectricLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return Rgb(0.0F);
    const PaneShares shares = pane_shares(lobe, at.wo.z);
    return lobe.tint * (shares.reflected + shares.transmitted);
}
bool is_delta_lobe(const ThinDielectricLobe&) {
    return true;
}
float chance_of(const ThinDielectricLobe& lobe, const Local& at) {
    return max_component(albedo_of(lobe, at));
}
std::optional<float> reflect_chance_of(const ThinDielectricLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return std::nullopt;
    return reflect_chance_of(pane_shares(lobe, at.wo.z));
}
Rgb straight_share_of(const ThinDielectricLobe& lobe, const Local& at) {
    return at.wo.z > 0 ? lobe.tint * pane_shares(lobe, at.wo.z).transmitted : Rgb(0.0F);
}
bool is_sound(const ThinDielectricLobe& lobe) {
    return lobe.eta > 0 && std::isfinite(lobe.eta) && is_share(lobe.tint) && lobe.inside > 0 &&
           lobe.inside <= 1;
}

}  // namespace lucerna
