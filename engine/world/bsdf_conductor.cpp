// Mirrors and metals.
#include "engine/world/fresnel.h"
#include "engine/world/lobe_models.h"

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

// --- Conductor

namespace {

Rgb reflectance(const ConductorLobe& lobe, float cos_o) {
    return lobe.tint * fresnel_conductor(cos_o, lobe.eta, lobe.k);
}
bool reflects_at_facets(const Local& at) {
    return !at.transmission && at.wo.z > kGrazing && at.wi.z > kGrazing;
}

}  // namespace

bool is_delta_lobe(const ConductorLobe& lobe) {
    return is_smooth(lobe.alpha_x, lobe.alpha_y);
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
float chance_of(const ConductorLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return 0;
    return std::max(max_component(reflectance(lobe, at.wo.z)), kLeastChance * max_component(lobe.tint));
}
bool is_sound(const ConductorLobe& lobe) {
    const bool indices = std::min({lobe.eta.x, lobe.eta.y, lobe.eta.z, lobe.k.x, lobe.k.y, lobe.k.z}) >= 0 &&
                         is_finite(lobe.eta) && is_finite(lobe.k);
    return indices && is_share(lobe.tint) && is_alpha(lobe.alpha_x) && is_alpha(lobe.alpha_y);
}

}  // namespace lucerna
