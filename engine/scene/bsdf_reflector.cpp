// Implements mirrors, and facets that are mirrors: metal, varnish, varnished metal.
#include "engine/scene/fresnel.h"
#include "engine/scene/lobe_models.h"

namespace lucerna {

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
float chance_of(const MirrorLobe& lobe, const Local& at) {
    return max_component(albedo_of(lobe, at));
}
bool is_sound(const MirrorLobe& lobe) {
    return is_share(lobe.reflectance);
}

// --- Functions of facets that metal, varnish and varnished metal share

namespace {

// Returns the reflectance of a facet that turns wo to wi; `cos_o` = wo·m.
Rgb reflectance(const ConductorLobe& lobe, const Local&, float cos_o) {
    return lobe.tint * fresnel_conductor(cos_o, lobe.eta, lobe.k);
}
Rgb reflectance(const GlossLobe& lobe, const Local&, float cos_o) {
    return lobe.tint * fresnel_dielectric(cos_o, lobe.eta).reflectance;
}
Rgb reflectance(const CoatedConductorLobe& lobe, const Local& at, float cos_o) {
    // The varnish refracts light before it meets the metal.
    const float c = std::clamp(cos_o, 0.0F, 1.0F);
    const float cos2 = 1 - (1 - c) * (1 + c) / (lobe.coat_eta * lobe.coat_eta);
    const Rgb r = cos2 > 0 ? fresnel_conductor(std::sqrt(cos2), lobe.eta, lobe.k) : Rgb(1.0F);
    const float e_o = lobe.table->rough(at.wo.z, lobe.coat_alpha);
    const float e_i = lobe.table->rough(at.wi.z, lobe.coat_alpha);
    const float through = (1 - e_o) * (1 - e_i);
    const float back = std::min(e_o, e_i);
    Rgb sum;
    // The divisor is at least 1 - back, a factor of `through`; where it is close to 0, so is the sum.
    for (int k = 0; k < 3; ++k) sum[k] = lobe.tint[k] * r[k] * through / std::max(1 - r[k] * back, 1e-6F);
    return sum;
}

template <typename Rough>
bool is_delta_of(const Rough& lobe) {
    return is_smooth(lobe.alpha_x, lobe.alpha_y);
}

// Returns F D G2 / (4 cos_o cos_i) [Walter 2007, (20)].
template <typename Rough>
Rgb value_of(const Rough& lobe, const Local& at) {
    if (is_delta_of(lobe) || !is_reflection(at)) return Rgb(0.0F);
    const Ggx facets = facets_of(lobe);
    const V3f m = (at.wo + at.wi).normalized();  // not 0, because both are above the horizon
    const float shape = facets.density(m) * facets.masking_shadowing_over_cos2(at.wo, at.wi) / 4;
    return reflectance(lobe, at, at.wo.dot(m)) * shape;
}
// Returns the facet's density divided by the Jacobian 4 wo·m (dω_i = 4 wo·m dω_m); wo·m cancels.
template <typename Rough>
float density_of(const Rough& lobe, const Local& at) {
    if (is_delta_of(lobe) || !is_reflection(at)) return 0;
    const Ggx facets = facets_of(lobe);
    return facets.masking_over_cos(at.wo) * facets.density((at.wo + at.wi).normalized()) / 4;
}
template <typename Rough>
Draw draw_of(const Rough& lobe, const Local& at, const BsdfU& u) {
    if (!(at.wo.z > 0)) return std::nullopt;
    Local to = at;
    if (is_delta_of(lobe)) {
        to.wi = mirrored(at.wo);
        return LocalSample{.wi = to.wi, .weight = reflectance(lobe, to, at.wo.z), .delta = true};
    }
    const Ggx facets = facets_of(lobe);
    const V3f m = facets.sample_visible(at.wo, u.direction);
    to.wi = reflected(at.wo, m).normalized();
    const float pdf = density_of(lobe, to);
    if (!(pdf > 0)) return std::nullopt;  // wi is below the surface: a second bounce, which is not modelled
    const Rgb weight = reflectance(lobe, to, at.wo.dot(m)) * facets.shadowing_if_visible(at.wo, to.wi);
    return LocalSample{.wi = to.wi, .weight = weight, .pdf_w = pdf};
}
template <typename Rough>
Rgb total_of(const Rough& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return Rgb(0.0F);
    Local to = at;
    to.wi = mirrored(at.wo);
    if (is_delta_of(lobe)) return reflectance(lobe, to, at.wo.z);
    const Ggx facets = facets_of(lobe);
    return mean_over_visible(facets, at.wo, [&](const V3f& m) {
        to.wi = reflected(at.wo, m);
        if (!(to.wi.z > 0)) return Rgb(0.0F);
        return reflectance(lobe, to, at.wo.dot(m)) * facets.shadowing_if_visible(at.wo, to.wi);
    });
}
// Returns the reflectance of the smooth surface, but at least a fraction of `most`.
template <typename Rough>
float guess_of(const Rough& lobe, const Local& at, float most) {
    if (!(at.wo.z > 0)) return 0;
    Local to = at;
    to.wi = mirrored(at.wo);
    return std::max(max_component(reflectance(lobe, to, at.wo.z)), kLeastChance * most);
}

bool is_index(const Rgb& c) {
    return is_finite(c) && std::min({c.x, c.y, c.z}) >= 0;
}

}  // namespace

// --- Conductor

Rgb value(const ConductorLobe& lobe, const Local& at, Transport) {
    return value_of(lobe, at);
}
float density(const ConductorLobe& lobe, const Local& at) {
    return density_of(lobe, at);
}
Draw draw(const ConductorLobe& lobe, const Local& at, const BsdfU& u, Transport) {
    return draw_of(lobe, at, u);
}
Rgb albedo_of(const ConductorLobe& lobe, const Local& at) {
    return total_of(lobe, at);
}
float chance_of(const ConductorLobe& lobe, const Local& at) {
    return guess_of(lobe, at, max_component(lobe.tint));
}
bool is_delta_lobe(const ConductorLobe& lobe) {
    return is_delta_of(lobe);
}
bool is_sound(const ConductorLobe& lobe) {
    return is_index(lobe.eta) && is_index(lobe.k) && is_share(lobe.tint) && is_alpha(lobe.alpha_x) &&
           is_alpha(lobe.alpha_y);
}

// --- Gloss

Rgb value(const GlossLobe& lobe, const Local& at, Transport) {
    return value_of(lobe, at);
}
float density(const GlossLobe& lobe, const Local& at) {
    return density_of(lobe, at);
}
Draw draw(const GlossLobe& lobe, const Local& at, const BsdfU& u, Transport) {
    return draw_of(lobe, at, u);
}
Rgb albedo_of(const GlossLobe& lobe, const Local& at) {
    return total_of(lobe, at);
}
float chance_of(const GlossLobe& lobe, const Local& at) {
    return guess_of(lobe, at, max_component(lobe.tint));
}
bool is_delta_lobe(const GlossLobe& lobe) {
    return is_delta_of(lobe);
}
bool is_sound(const GlossLobe& lobe) {
    return lobe.eta > 0 && std::isfinite(lobe.eta) && is_share(lobe.tint) && is_alpha(lobe.alpha_x) &&
           is_alpha(lobe.alpha_y);
}

// --- CoatedConductor

Rgb value(const CoatedConductorLobe& lobe, const Local& at, Transport) {
    return value_of(lobe, at);
}
float density(const CoatedConductorLobe& lobe, const Local& at) {
    return density_of(lobe, at);
}
Draw draw(const CoatedConductorLobe& lobe, const Local& at, const BsdfU& u, Transport) {
    return draw_of(lobe, at, u);
}
Rgb albedo_of(const CoatedConductorLobe& lobe, const Local& at) {
    return total_of(lobe, at);
}
float chance_of(const CoatedConductorLobe& lobe, const Local& at) {
    return guess_of(lobe, at, max_component(lobe.tint));
}
bool is_delta_lobe(const CoatedConductorLobe& lobe) {
    return is_delta_of(lobe);
}
bool is_sound(const CoatedConductorLobe& lobe) {
    return is_index(lobe.eta) && is_index(lobe.k) && lobe.coat_eta > 0 && std::isfinite(lobe.coat_eta) &&
           lobe.table && is_share(lobe.tint) && is_alpha(lobe.coat_alpha) && is_alpha(lobe.alpha_x) &&
           is_alpha(lobe.alpha_y);
}

}  // namespace lucerna
