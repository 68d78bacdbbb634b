// Gloss over a diffuse base by Ashikhmin and Shirley, "An Anisotropic Phong BRDF Model", 2000, with GGX in
// place of their Phong lobe, as pbrt-v3 has it (section 8.5).
#include "engine/base/warp.h"
#include "engine/world/lobe_models.h"

namespace lucerna {
namespace {

float fifth(float x) {
    return sqr(sqr(x)) * x;
}
Rgb schlick(const SubstrateLobe& lobe, float cos_o) {
    return lobe.specular + fifth(1 - std::clamp(cos_o, 0.0F, 1.0F)) * (Rgb(1.0F) - lobe.specular);
}
// How much of the base shows at a cosine [Ashikhmin 2000 (5)].
float shown(float cos) {
    return 1 - fifth(1 - std::min(cos, 1.0F) / 2);
}

// D F / (4 (wo·m) max(cos_o, cos_i)) [Ashikhmin 2000 (3)].
Rgb gloss(const SubstrateLobe& lobe, const Ggx& facets, const Local& at) {
    const V3f m = (at.wo + at.wi).normalized();  // not 0: both are above the horizon
    const float cos_o = at.wo.dot(m);
    if (!(cos_o > 0)) return Rgb(0.0F);
    return schlick(lobe, cos_o) * (facets.density(m) / (4 * cos_o * std::max(at.wo.z, at.wi.z)));
}
Rgb base(const SubstrateLobe& lobe, const Local& at) {
    // 28/23 makes the base's albedo `diffuse` times shown(), without gloss.
    const float shape = 28.0F / 23 * kInvPi * shown(at.wo.z) * shown(at.wi.z);
    return lobe.diffuse * (Rgb(1.0F) - lobe.specular) * shape;
}
bool is_above(const Local& at) {
    return !at.transmission && at.wo.z > kGrazing && at.wi.z > kGrazing;
}

struct Guess {
    float gloss = 0, base = 0;
};
Guess guess_of(const SubstrateLobe& lobe, float cos_o) {
    const Rgb base = lobe.diffuse * (Rgb(1.0F) - lobe.specular);
    return {max_component(schlick(lobe, cos_o)), max_component(base) * shown(cos_o)};
}
// Chance of drawing by the gloss: its share, but enough to cover the gloss where the guess is low.
float gloss_chance(const SubstrateLobe& lobe, float cos_o) {
    const Guess guess = guess_of(lobe, cos_o);
    const float sum = guess.gloss + guess.base;
    return sum > 0 ? std::max(guess.gloss / sum, kLeastChance) : 1.0F;
}

}  // namespace

Rgb value(const SubstrateLobe& lobe, const Local& at, Transport) {
    if (!is_above(at)) return Rgb(0.0F);
    return lobe.tint * (base(lobe, at) + gloss(lobe, facets_of(lobe), at));
}
float density(const SubstrateLobe& lobe, const Local& at) {
    if (!is_above(at)) return 0;
    const Ggx facets = facets_of(lobe);
    const float chance = gloss_chance(lobe, at.wo.z);
    const float by_facet = facets.masking_over_cos(at.wo) * facets.density((at.wo + at.wi).normalized()) / 4;
    return chance * by_facet + (1 - chance) * cosine_hemisphere_pdf_w(at.wi.z);
}
Draw draw(const SubstrateLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    if (!(at.wo.z > kGrazing)) return std::nullopt;
    Local to = at;
    if (u.lobe < gloss_chance(lobe, at.wo.z)) {
        to.wi = reflected(at.wo, facets_of(lobe).sample_visible(at.wo, u.direction)).normalized();
    } else {
        to.wi = square_to_cosine_hemisphere(u.direction);
    }
    const float pdf = density(lobe, to);
    if (!(pdf > 0)) return std::nullopt;
    return LocalSample{.wi = to.wi, .weight = value(lobe, to, transport) * (to.wi.z / pdf), .pdf_w = pdf};
}
Rgb albedo_of(const SubstrateLobe& lobe, const Local& at) {
    if (!(at.wo.z > kGrazing)) return Rgb(0.0F);
    const Ggx facets = facets_of(lobe);
    const Rgb below = lobe.diffuse * (Rgb(1.0F) - lobe.specular) * shown(at.wo.z);
    // The gloss over the density of its facets: F cos_i cos_o / ((wo·m) max(cos_o, cos_i) G1(o)).
    const float over = 1 / facets.masking_over_cos(at.wo);
    const Rgb above = mean_over_visible(facets, at.wo, [&](const V3f& m) {
        const float cos_o = at.wo.dot(m);
        const V3f wi = reflected(at.wo, m);
        if (!(wi.z > 0 && cos_o > 0)) return Rgb(0.0F);
        return schlick(lobe, cos_o) * (over * wi.z / (cos_o * std::max(at.wo.z, wi.z)));
    });
    const Rgb sum = lobe.tint * (below + above);
    return {std::min(sum.x, 1.0F), std::min(sum.y, 1.0F), std::min(sum.z, 1.0F)};
}
bool is_delta_lobe(const SubstrateLobe&) {
    return false;
}
float chance_of(const SubstrateLobe& lobe, const Local& at) {
    if (!(at.wo.z > 0)) return 0;
    const Guess guess = guess_of(lobe, at.wo.z);
    return max_component(lobe.tint) * std::max(guess.gloss + guess.base, kLeastChance);
}
bool is_sound(const SubstrateLobe& lobe) {
    return is_share(lobe.diffuse) && is_share(lobe.specular) && is_share(lobe.tint) &&
           is_alpha(lobe.alpha_x) && is_alpha(lobe.alpha_y) && std::max(lobe.alpha_x, lobe.alpha_y) <= 1;
}

}  // namespace lucerna
