#include "engine/scene/material.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace lucerna {
namespace {

// --- Values of textures

Rgb share_of(const RgbTexture& texture, const TexturePoint& point) {
    return as_share(texture.at(point));
}
Rgb share_of(const std::optional<RgbTexture>& texture, const TexturePoint& point, float otherwise) {
    return texture ? share_of(*texture, point) : Rgb(otherwise);
}
float eta_of(const FloatTexture& texture, const TexturePoint& point) {
    return in_range(texture.at(point), 0.01F, 100);
}
Rgb index_of(const RgbTexture& texture, const TexturePoint& point) {
    return in_range(texture.at(point), 0, 1e6F);
}
float largest(const Rgb& a, const Rgb& b) {
    return max_component(a + b);
}
Rgb larger(const Rgb& a, const Rgb& b) {
    return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
// Returns the factors that reduce each channel to at most 1.
Rgb down_to_one(const Rgb& c) {
    return {1 / std::max(c.x, 1.0F), 1 / std::max(c.y, 1.0F), 1 / std::max(c.z, 1.0F)};
}

// Returns the alphas of a surface whose table is `table`.
V2f covered_alpha(const Roughness& roughness, const CoatTable* table, const TexturePoint& point) {
    const V2f alpha = roughness.alpha(point);
    if (!table || !table->any_alpha()) return alpha;
    const float least = std::min(alpha.x, alpha.y);
    return {least, least};
}

// --- Metals

// Returns k of a metal with eta = 1 and reflectance r at normal incidence: r = k²/(4 + k²).
Rgb k_of_reflectance(const Rgb& r) {
    Rgb k;
    for (int c = 0; c < 3; ++c) {
        const float clamped = std::min(r[c], 0.9999F);  // keeps the divisor away from 0
        k[c] = 2 * std::sqrt(clamped / (1 - clamped));
    }
    return k;
}

ConductorLobe metal_lobe(const ConductorMaterial& m, const TexturePoint& point) {
    const V2f alpha = m.roughness.alpha(point);
    ConductorLobe lobe{index_of(m.eta, point), index_of(m.k, point), Rgb(1.0F), alpha.x, alpha.y};
    if (m.reflectance) {
        lobe.eta = Rgb(1.0F);
        lobe.k = k_of_reflectance(share_of(*m.reflectance, point));
    }
    return lobe;
}

// Returns the transmittance t between the faces of a pane of transmittance T at normal incidence. With the
// reflectance F of a face, T = (1 - F)² t / (1 - F² t²).
float inside_of(float transmittance, float eta) {
    const double f = sqr((double{eta} - 1) / (double{eta} + 1)), whole = double{transmittance};
    const double through = sqr(1 - f);
    return static_cast<float>(
        std::min(1.0, 2 * whole / (through + std::sqrt(sqr(through) + sqr(2 * f * whole)))));
}

// --- One overload per material

struct AddLobes {
    const TexturePoint& point;
    LobeList& list;

    void operator()(const DiffuseMaterial& m) const {
        const Rgb albedo = share_of(m.reflectance, point);
        const float degrees = in_range(m.sigma.at(point), 0, 90);
        if (degrees == 0) return list.add(DiffuseLobe{albedo});
        list.add(oren_nayar(albedo, degrees * (kPi / 180)));
    }
    void operator()(const MirrorMaterial& m) const { list.add(MirrorLobe{share_of(m.reflectance, point)}); }
    void operator()(const ConductorMaterial& m) const { list.add(metal_lobe(m, point)); }
    void operator()(const DielectricMaterial& m) const {
        const V2f alpha = m.roughness.alpha(point);
        list.add(DielectricLobe{eta_of(m.eta, point), share_of(m.reflect, point), share_of(m.transmit, point),
                                alpha.x, alpha.y});
    }
    void operator()(const ThinDielectricMaterial& m) const {
        const float eta = eta_of(m.eta, point);
        list.add(ThinDielectricLobe{eta, Rgb(1.0F), m.transmittance ? inside_of(*m.transmittance, eta) : 1});
    }
    void operator()(const DiffuseTransmissionMaterial& m) const {
        const Rgb r = share_of(m.reflectance, point) * m.scale;
        const Rgb t = share_of(m.transmittance, point) * m.scale;
        const Rgb down = down_to_one(r + t);
        list.add(DiffuseLobe{r * down});
        if (!is_black(t)) list.add(DiffuseTransmitLobe{t * down});
    }

    // The base returns ρ (1 - F)/(1 - ρ F) of the light that passes the varnish, which is 1 - mean E of
    // diffuse light. F is the share of diffuse light that the varnish reflects back inside. By reciprocity 1
    // - F = (1 - mean E)/η².
    void operator()(const CoatedDiffuseMaterial& m) const {
        const V2f alpha = covered_alpha(m.coat.roughness, m.coat.table.get(), point);
        const float least = std::min(alpha.x, alpha.y);
        // The limit keeps a varnish that lets almost no light in (an index far below 1) from a division by 0.
        const float in = std::max(1 - m.coat.table->rough_mean(least), 1e-4F);
        const float out = std::min(in / (m.coat.eta * m.coat.eta), 1.0F);
        const Rgb rho = share_of(m.reflectance, point);
        Rgb albedo;
        for (int c = 0; c < 3; ++c) albedo[c] = rho[c] * out / ((1 - rho[c] * (1 - out)) * in);
        if (m.coat.eta != 1) list.add(GlossLobe{m.coat.eta, Rgb(1.0F), alpha.x, alpha.y});
        list.add(
            CoveredDiffuseLobe{albedo, {.table = m.coat.table.get(), .alpha = least, .gloss = Rgb(1.0F)}});
    }

    // These relations hold for small angles. A facet of the metal tilted by m turns the light by 2m inside
    // the varnish, by 2 η m outside. A facet of the varnish tilted by m turns it by (η - 1) m, once in, once
    // out.
    void operator()(const CoatedConductorMaterial& m) const {
        const V2f coat = covered_alpha(m.coat.roughness, m.coat.table.get(), point);
        const ConductorLobe metal = metal_lobe(m.metal, point);
        const float eta = m.coat.eta;
        const auto seen = [&](float alpha, float above) {
            return std::min(std::sqrt(sqr(eta * alpha) + sqr((eta - 1) * above) / 2), 2.0F);
        };
        CoatedConductorLobe lobe;
        lobe.eta = metal.eta / eta;
        lobe.k = metal.k / eta;
        lobe.coat_eta = eta;
        lobe.coat_alpha = std::min(coat.x, coat.y);
        lobe.table = m.coat.table.get();
        lobe.alpha_x = seen(metal.alpha_x, coat.x);
        lobe.alpha_y = seen(metal.alpha_y, coat.y);
        if (eta != 1) list.add(GlossLobe{eta, Rgb(1.0F), coat.x, coat.y});
        list.add(lobe);
    }

    void operator()(const UberMaterial& m) const {
        const Rgb opacity = share_of(m.opacity, point, 1);
        const float eta = eta_of(m.eta, point);
        Rgb gloss = share_of(m.gloss, point);
        Rgb reflect = share_of(m.reflect, point, 0), transmit = share_of(m.transmit, point, 0);
        const Rgb down = down_to_one(gloss + larger(reflect, transmit));
        gloss *= down, reflect *= down, transmit *= down;
        const V2f alpha = covered_alpha(m.roughness, m.table.get(), point);

        // A component that opacity makes black must not count as a lobe that scatters.
        const Rgb diffuse = share_of(m.diffuse, point), base = diffuse * opacity;
        if (largest(diffuse + gloss, larger(reflect, transmit)) <= 1) {
            if (!is_black(base)) list.add(DiffuseLobe{base});
        } else if (!is_black(base)) {
            list.add(CoveredDiffuseLobe{
                base, {m.table.get(), std::min(alpha.x, alpha.y), gloss, reflect, transmit}});
        }
        gloss *= opacity, reflect *= opacity, transmit *= opacity;
        if (!is_black(gloss)) list.add(GlossLobe{eta, gloss, alpha.x, alpha.y});
        if (!is_black(reflect) || !is_black(transmit)) list.add(DielectricLobe{eta, reflect, transmit});
        if (opacity != Rgb(1.0F)) list.add(DielectricLobe{1, Rgb(0.0F), Rgb(1.0F) - opacity});
    }

    void operator()(const SubstrateMaterial& m) const {
        const V2f alpha = m.roughness.alpha(point);
        const Rgb specular = share_of(m.specular, point);
        list.add(SubstrateBaseLobe{share_of(m.diffuse, point), specular});
        list.add(SubstrateGlossLobe{specular, std::min(alpha.x, 1.0F), std::min(alpha.y, 1.0F)});
    }

    void operator()(const TranslucentMaterial& m) const {
        Rgb reflect = share_of(m.reflect, point), transmit = share_of(m.transmit, point);
        const Rgb down = down_to_one(reflect + transmit);
        reflect *= down, transmit *= down;
        const Rgb gloss = share_of(m.gloss, point);
        // The larger of the rough glass's two parts bounds what the glass takes; the rest is left for the
        // diffuse lobes.
        Rgb diffuse = share_of(m.diffuse, point);
        const Rgb most = Rgb(1.0F) - gloss * larger(reflect, transmit);
        for (int c = 0; c < 3; ++c) {
            const float all = diffuse[c] * (reflect[c] + transmit[c]);
            if (all > most[c]) diffuse[c] *= most[c] / all;
        }
        if (!is_black(diffuse * reflect)) list.add(DiffuseLobe{diffuse * reflect});
        if (!is_black(diffuse * transmit)) list.add(DiffuseTransmitLobe{diffuse * transmit});
        const V2f alpha = m.roughness.alpha(point);
        if (!is_black(gloss))
            list.add(DielectricLobe{1.5F, gloss * reflect, gloss * transmit, alpha.x, alpha.y});
    }

    // Both lobes reflect everything at grazing, so that the sum is that of one metal, split between them.
    void operator()(const ShinyMetalMaterial& m) const {
        const Rgb gloss = share_of(m.gloss, point), mirror = share_of(m.mirror, point);
        const Rgb sum = gloss + mirror;
        const Rgb k = k_of_reflectance(in_range(sum, 0, 1));
        Rgb rough;
        for (int c = 0; c < 3; ++c) rough[c] = sum[c] > 0 ? gloss[c] / sum[c] : 0.0F;
        const V2f alpha = m.roughness.alpha(point);
        if (!is_black(gloss)) list.add(ConductorLobe{Rgb(1.0F), k, rough, alpha.x, alpha.y});
        if (!is_black(mirror)) list.add(ConductorLobe{Rgb(1.0F), k, Rgb(1.0F) - rough});
    }

    void operator()(const MixMaterial& m) const;

    void operator()(const InterfaceMaterial&) const {
        list.add(DielectricLobe{1, Rgb(0.0F), Rgb(1.0F)});  // an interface in a mix
    }
};

// --- Mixing

struct Scale {
    Rgb by;

    void operator()(BlackLobe&) const {}
    void operator()(DiffuseLobe& lobe) const { lobe.albedo *= by; }
    void operator()(DiffuseTransmitLobe& lobe) const { lobe.albedo *= by; }
    void operator()(OrenNayarLobe& lobe) const { lobe.albedo *= by; }
    void operator()(CoveredDiffuseLobe& lobe) const { lobe.albedo *= by; }
    void operator()(MirrorLobe& lobe) const { lobe.reflectance *= by; }
    void operator()(DielectricLobe& lobe) const { lobe.reflect *= by, lobe.transmit *= by; }
    template <typename Tinted>
    void operator()(Tinted& lobe) const {
        lobe.tint *= by;
    }
};

void AddLobes::operator()(const MixMaterial& m) const {
    const Rgb second = std::holds_alternative<FloatTexture>(m.share)
                           ? Rgb(in_range(std::get<FloatTexture>(m.share).at(point), 0, 1))
                           : share_of(std::get<RgbTexture>(m.share), point);
    const auto add = [&](const Material& material, const Rgb& share) {
        if (is_black(share)) return;
        const std::size_t before = list.size();
        add_lobes(material.model, point, list);
        for (Lobe& lobe : list.from(before)) std::visit(Scale{share}, lobe);
    };
    add(*m.first, Rgb(1.0F) - second);
    add(*m.second, second);
}

}  // namespace

void add_lobes(const MaterialModel& model, const TexturePoint& point, LobeList& list) {
    std::visit(AddLobes{point, list}, model);
}

}  // namespace lucerna
