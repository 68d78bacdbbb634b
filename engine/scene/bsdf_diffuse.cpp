// Implements the lobes without a peak.
#include "engine/base/elementary.h"
#include "engine/base/warp.h"
#include "engine/scene/fresnel.h"
#include "engine/scene/lobe_models.h"

namespace lucerna {

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
float chance_of(const BlackLobe&, const Local&) {
    return 0;
}
bool is_sound(const BlackLobe&) {
    return true;
}

// --- Lobes that are sampled by the cosine

namespace {

float density_by_cosine(const Local& at) {
    return at.transmission ? 0.0F : cosine_hemisphere_pdf_w(at.wi.z);
}
template <typename Diffuse>
Draw draw_by_cosine(const Diffuse& lobe, const Local& at, const BsdfU& u, Transport transport) {
    Local to = at;
    to.wi = square_to_cosine_hemisphere(u.direction);
    if (!(to.wi.z > 0) || !is_lit(to, transport)) return std::nullopt;
    return LocalSample{
        .wi = to.wi, .weight = value(lobe, to, transport) * kPi, .pdf_w = cosine_hemisphere_pdf_w(to.wi.z)};
}
// Draws from a Lambertian lobe on either side of the surface, whose weight is its albedo.
Draw draw_lambertian(const Rgb& albedo, bool transmission, const Local& at, const BsdfU& u,
                     Transport transport) {
    const V3f w = square_to_cosine_hemisphere(u.direction);
    if (!(w.z > 0) || (transport == Transport::particles && at.wo.z < 0)) return std::nullopt;
    return LocalSample{.wi = {w.x, w.y, transmission ? -w.z : w.z},
                       .weight = albedo,
                       .pdf_w = cosine_hemisphere_pdf_w(w.z),
                       .transmission = transmission};
}

}  // namespace

// --- Lambertian reflection

Rgb value(const DiffuseLobe& lobe, const Local& at, Transport transport) {
    return at.transmission || !is_lit(at, transport) ? Rgb(0.0F) : lobe.albedo * kInvPi;
}
float density(const DiffuseLobe&, const Local& at) {
    return density_by_cosine(at);
}
Draw draw(const DiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    return draw_lambertian(lobe.albedo, false, at, u, transport);
}
Rgb albedo_of(const DiffuseLobe& lobe, const Local&) {
    return lobe.albedo;
}
bool is_delta_lobe(const DiffuseLobe&) {
    return false;
}
float chance_of(const DiffuseLobe& lobe, const Local&) {
    return max_component(lobe.albedo);
}
bool is_sound(const DiffuseLobe& lobe) {
    return is_share(lobe.albedo);
}

// --- Lambertian transmission

Rgb value(const DiffuseTransmitLobe& lobe, const Local& at, Transport transport) {
    // The light must be on its own side of the shading plane, as for reflection.
    const bool lit = transport == Transport::radiance ? at.wi.z <= 0 : at.wo.z >= 0;
    return at.transmission && lit ? lobe.albedo * kInvPi : Rgb(0.0F);
}
float density(const DiffuseTransmitLobe&, const Local& at) {
    return at.transmission ? cosine_hemisphere_pdf_w(-at.wi.z) : 0.0F;
}
Draw draw(const DiffuseTransmitLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    return draw_lambertian(lobe.albedo, true, at, u, transport);
}
Rgb albedo_of(const DiffuseTransmitLobe& lobe, const Local&) {
    return lobe.albedo;
}
bool is_delta_lobe(const DiffuseTransmitLobe&) {
    return false;
}
float chance_of(const DiffuseTransmitLobe& lobe, const Local&) {
    return max_component(lobe.albedo);
}
bool is_sound(const DiffuseTransmitLobe& lobe) {
    return is_share(lobe.albedo);
}

// --- Oren and Nayar

OrenNayarLobe oren_nayar(const Rgb& albedo, float sigma) {
    const float s2 = sigma * sigma;
    OrenNayarLobe lobe{albedo, 1 - 0.5F * s2 / (s2 + 0.33F), 0.45F * s2 / (s2 + 0.09F)};
    const float most = 1 / std::max(1.0F, lobe.a + 0.5F * lobe.b);
    for (int c = 0; c < 3; ++c) lobe.albedo[c] = std::min(lobe.albedo[c], most);
    return lobe;
}

Rgb value(const OrenNayarLobe& lobe, const Local& at, Transport transport) {
    if (at.transmission || !is_lit(at, transport)) return Rgb(0.0F);
    // This is sin α tan β cos Δφ with α the larger of the two angles. Both sines and cos Δφ form the inner
    // product of the tangential components.
    const float across = at.wo.x * at.wi.x + at.wo.y * at.wi.y;
    const float cos_beta = std::max({std::fabs(at.wo.z), std::fabs(at.wi.z), kGrazingCos});
    return lobe.albedo * (kInvPi * (lobe.a + lobe.b * std::max(0.0F, across) / cos_beta));
}
float density(const OrenNayarLobe&, const Local& at) {
    return density_by_cosine(at);
}
Draw draw(const OrenNayarLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    return draw_by_cosine(lobe, at, u, transport);
}
// Returns the model integrated over wi in closed form: a + b g, where g grows from 0 at normal incidence to
// 1/2 at grazing.
Rgb albedo_of(const OrenNayarLobe& lobe, const Local& at) {
    const float c = std::clamp(std::fabs(at.wo.z), 0.0F, 1.0F);
    const float s = std::sqrt(1 - c * c);
    const float theta = acos(c);
    // This is tan θ (1 - sin³ θ) without dividing by a vanishing cosine: 1 - s³ = c² (1 + s + s²)/(1 + s).
    const float beyond = s * c * (1 + s + s * s) / (1 + s) / 3;
    const float g = 2 * kInvPi * (s * (theta - s * c) / 2 + beyond);
    return lobe.albedo * (lobe.a + lobe.b * g);
}
bool is_delta_lobe(const OrenNayarLobe&) {
    return false;
}
float chance_of(const OrenNayarLobe& lobe, const Local&) {
    return max_component(lobe.albedo);
}
bool is_sound(const OrenNayarLobe& lobe) {
    return is_share(lobe.albedo * std::max(lobe.a, lobe.a + lobe.b / 2)) && lobe.a > 0 && lobe.b >= 0;
}

// --- Diffuse under a cover

namespace {

// Returns 1 - reach of the cover. passed_mean() returns its cosine-weighted mean over the hemisphere.
Rgb passed(const Cover& cover, float cos, bool entering) {
    if (!cover.table) {
        const Rgb& r = cover.reflect;
        const Rgb& t = cover.transmit;
        return Rgb(1.0F) - cover.gloss - Rgb(std::max(r.x, t.x), std::max(r.y, t.y), std::max(r.z, t.z));
    }
    const float mu = std::clamp(std::fabs(cos), 0.0F, 1.0F);
    Rgb result = Rgb(1.0F) - cover.gloss * cover.table->rough(mu, cover.alpha);
    if (is_black(cover.reflect) && is_black(cover.transmit)) return result;
    const float fresnel = cover.table->smooth(mu, entering);
    return result - cover.reflect * fresnel - cover.transmit * (1 - fresnel);
}
Rgb passed_mean(const Cover& cover, bool entering) {
    if (!cover.table) return passed(cover, 1, entering);
    const float fresnel = cover.table->smooth_mean(entering);
    return Rgb(1.0F) - cover.gloss * cover.table->rough_mean(cover.alpha) - cover.reflect * fresnel -
           cover.transmit * (1 - fresnel);
}
// Rounding may make a share slightly negative.
Rgb not_negative(const Rgb& c) {
    return {std::max(c.x, 0.0F), std::max(c.y, 0.0F), std::max(c.z, 0.0F)};
}

}  // namespace

Rgb value(const CoveredDiffuseLobe& lobe, const Local& at, Transport transport) {
    if (at.transmission || !is_lit(at, transport)) return Rgb(0.0F);
    return lobe.albedo * not_negative(passed(lobe.cover, at.wo.z, at.entering)) *
           not_negative(passed(lobe.cover, at.wi.z, at.entering)) * kInvPi;
}
float density(const CoveredDiffuseLobe&, const Local& at) {
    return density_by_cosine(at);
}
Draw draw(const CoveredDiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport) {
    return draw_by_cosine(lobe, at, u, transport);
}
Rgb albedo_of(const CoveredDiffuseLobe& lobe, const Local& at) {
    const Rgb all = lobe.albedo * not_negative(passed(lobe.cover, at.wo.z, at.entering)) *
                    not_negative(passed_mean(lobe.cover, at.entering));
    return at_most_one(all);
}
bool is_delta_lobe(const CoveredDiffuseLobe&) {
    return false;
}
float chance_of(const CoveredDiffuseLobe& lobe, const Local& at) {
    return std::max(max_component(albedo_of(lobe, at)), kLeastChance * max_component(lobe.albedo));
}
bool is_sound(const CoveredDiffuseLobe& lobe) {
    const Rgb& r = lobe.cover.reflect;
    const Rgb& t = lobe.cover.transmit;
    const bool cover =
        is_share(lobe.cover.gloss + r) && is_share(lobe.cover.gloss + t) && is_alpha(lobe.cover.alpha);
    return cover && is_finite(lobe.albedo) && std::min({lobe.albedo.x, lobe.albedo.y, lobe.albedo.z}) >= 0;
}

}  // namespace lucerna
