// Implements gloss over a diffuse base [Ashikhmin and Shirley 2000], with GGX in place of their Phong lobe,
// as in pbrt-v3 (section 8.5).
#include "engine/base/warp.h"
#include "engine/scene/lobe_models.h"

namespace lucerna {
namespace {

float fifth(float x) {
    return sqr(sqr(x)) * x;
}
Rgb schlick(const SubstrateGlossLobe& lobe, float cos_o) {
    return lobe.specular + fifth(1 - std::clamp(cos_o, 0.0F, 1.0F)) * (Rgb(1.0F) - lobe.specular);
}
// Returns how much of the base shows at a cosine [Ashikhmin and Shirley 2000, (5)].
float shown(float cos) {
    return 1 - fifth(1 - std::min(cos, 1.0F) / 2);
}
Rgb base_of(const SubstrateBaseLobe& lobe) {
    return lobe.tint * lobe.diffuse * (Rgb(1.0F) - lobe.specular);
}
// Returns the sample with direction to.wi, or none if its density is 0.
template <typename Substrate>
Draw with_weight(const Substrate& lobe, const Local& to, Transport transport) {
    const float pdf = density(lobe, to);
    if (!(pdf > 0)) return std::nullopt;
    return LocalSample{.wi = to.wi, .weight = value(lobe, to, transport) * (to.wi.z / pdf), .pdf_w = pdf};
}

}  // namespace

// --- The base

Rgb value(const SubstrateBaseLobe& lobe, const Local& at, Transport) {
    if (!is_reflection(at)) return Rgb(0.0F);
    // Without gloss, 28/23 makes the base's albedo `diffuse` times shown().
    return base_of(lobe) * (28.0F / 23 * kInvPi * shown(at.wo.z) * shown(at.wi.z));
}
float density(const SubstrateBaseLobe&, const Local& at) {
    return is_reflection(at) ? cosine_hemisphere_pdf_w(at.wi.z) : 0.0F;
}
Draw draw(const SubstrateBaseLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    Local to = at;
    to.wi = square_to_cosine_hemisphere(u.direction);
    return with_weight(lobe, to, transport);
}
Rgb albedo_of(const SubstrateBaseLobe& lobe, const Local& at) {
    return at.wo.z > kGrazingCos ? base_of(lobe) * shown(at.wo.z) : Rgb(0.0F);
}
bool is_delta_lobe(const SubstrateBaseLobe&) {
    return false;
}
float chance_of(const SubstrateBaseLobe& lobe, const Local& at) {
    return at.wo.z > 0 ? max_component(base_of(lobe)) * shown(at.wo.z) : 0.0F;
}
bool is_sound(const SubstrateBaseLobe& lobe) {
    return is_share(lobe.diffuse) && is_share(lobe.specular) && is_share(lobe.tint);
}

// --- The gloss

// Returns D F / (4 (wo·m) max(cos_o, cos_i)) [Ashikhmin and Shirley 2000, (3)].
Rgb value(const SubstrateGlossLobe& lobe, const Local& at, Transport) {
    if (!is_reflection(at)) return Rgb(0.0F);
    const V3f m = (at.wo + at.wi).normalized();  // not 0, because both are above the horizon
    const float cos_o = at.wo.dot(m);
    if (!(cos_o > 0)) return Rgb(0.0F);
    const float shape = facets_of(lobe).density(m) / (4 * cos_o * std::max(at.wo.z, at.wi.z));
    return lobe.tint * schlick(lobe, cos_o) * shape;
}
float density(const SubstrateGlossLobe& lobe, const Local& at) {
    if (!is_reflection(at)) return 0;
    const Ggx facets = facets_of(lobe);
    return facets.masking_over_cos(at.wo) * facets.density((at.wo + at.wi).normalized()) / 4;
}
Draw draw(const SubstrateGlossLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    if (!(at.wo.z > kGrazingCos)) return std::nullopt;
    Local to = at;
    to.wi = reflected(at.wo, facets_of(lobe).sample_visible(at.wo, u.direction)).normalized();
    return with_weight(lobe, to, transport);
}
Rgb albedo_of(const SubstrateGlossLobe& lobe, const Local& at) {
    if (!(at.wo.z > kGrazingCos)) return Rgb(0.0F);
    const Ggx facets = facets_of(lobe);
    // The weight is the gloss over its facets' density: F cos_i cos_o / ((wo·m) max(cos_o, cos_i) G1(o)).
    const float over = 1 / facets.masking_over_cos(at.wo);
    const Rgb mean = mean_over_visible(facets, at.wo, [&](const V3f& m) {
        const float cos_o = at.wo.dot(m);
        const V3f wi = reflected(at.wo, m);
        if (!(wi.z > 0 && cos_o > 0)) return Rgb(0.0F);
        return schlick(lobe, cos_o) * (over * wi.z / (cos_o * std::max(at.wo.z, wi.z)));
    });
    return at_most_one(lobe.tint * mean);
}
bool is_delta_lobe(const SubstrateGlossLobe&) {
    return false;
}
float chance_of(const SubstrateGlossLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return 0;
    // The lower limit provides enough samples where the guess is too low.
    return max_component(lobe.tint) * std::max(max_component(schlick(lobe, at.wo.z)), kLeastChance);
}
bool is_sound(const SubstrateGlossLobe& lobe) {
    return is_share(lobe.specular) && is_share(lobe.tint) && is_alpha(lobe.alpha_x) &&
           is_alpha(lobe.alpha_y) && std::max(lobe.alpha_x, lobe.alpha_y) <= 1;
}

}  // namespace lucerna
