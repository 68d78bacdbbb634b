#include "engine/scene/material.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/scene/scene.h"

namespace lucerna {

float alpha_of(RoughnessMap map, float roughness) {
    const double r = roughness > 0 ? std::min(static_cast<double>(roughness), 1e3) : 0.0;
    switch (map) {
        case RoughnessMap::alpha:
            break;
        case RoughnessMap::v2: {
            // Blinn's D ∝ cos^n equals GGX's with alpha² = 2/(n + 2) for narrow lobes [Walter 2007, 5.2].
            // pbrt limits n to 10000.
            return static_cast<float>(std::sqrt(2 / (1 / std::max(r, 1e-4) + 2)));
        }
        case RoughnessMap::v3: {
            const double x = log(std::clamp(r, 1e-3, 1.0));
            const double alpha = 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
            return static_cast<float>(alpha);
        }
        case RoughnessMap::v4:
            return static_cast<float>(std::sqrt(r));
    }
    return static_cast<float>(r);
}

V2f Roughness::alpha(const TexturePoint& point) const {
    const V2f alpha(alpha_of(map, x.at(point)), alpha_of(map, y.at(point)));
    if (std::max(alpha.x, alpha.y) < kSmoothAlpha) return {0, 0};
    return {std::max(alpha.x, kLeastAlpha), std::max(alpha.y, kLeastAlpha)};
}

std::optional<V2f> Roughness::constant_alpha() const {
    if (!x.constant_value() || !y.constant_value()) return std::nullopt;
    return alpha(V2f(0, 0));
}

bool Roughness::may_be_smooth() const {
    const auto both = constant_alpha();
    return !both || std::max(both->x, both->y) < kSmoothAlpha;
}

namespace {

struct MayBeDelta {
    bool operator()(const MirrorMaterial&) const { return true; }
    bool operator()(const ConductorMaterial& m) const { return m.roughness.may_be_smooth(); }
    bool operator()(const DielectricMaterial& m) const {
        const auto eta = m.eta.constant_value();
        return m.roughness.may_be_smooth() || !eta || std::fabs(*eta - 1) < kLeastBend;
    }
    bool operator()(const ThinDielectricMaterial&) const { return true; }
    bool operator()(const CoatedDiffuseMaterial& m) const { return m.coat.roughness.may_be_smooth(); }
    bool operator()(const CoatedConductorMaterial& m) const {
        return m.coat.roughness.may_be_smooth() || m.metal.roughness.may_be_smooth();
    }
    bool operator()(const UberMaterial& m) const {
        return m.reflect || m.transmit || m.opacity || m.roughness.may_be_smooth();
    }
    bool operator()(const TranslucentMaterial& m) const { return m.roughness.may_be_smooth(); }
    bool operator()(const ShinyMetalMaterial&) const { return true; }
    bool operator()(const MixMaterial& m) const {
        const auto part = [](const Material& material) {
            return is_interface(material) || is_specular(material);
        };
        return part(*m.first) || part(*m.second);
    }
    template <typename NeverDelta>
    bool operator()(const NeverDelta&) const {
        return false;
    }
};

struct MayHavePeak {
    bool operator()(const DiffuseMaterial&) const { return false; }
    bool operator()(const DiffuseTransmissionMaterial&) const { return false; }
    bool operator()(const InterfaceMaterial&) const { return false; }
    bool operator()(const UberMaterial& m) const {
        const auto gloss = m.gloss.constant_value();
        return m.reflect || m.transmit || m.opacity || !gloss || !is_black(*gloss);
    }
    bool operator()(const TranslucentMaterial& m) const {
        const auto gloss = m.gloss.constant_value();
        return !gloss || !is_black(*gloss);
    }
    bool operator()(const MixMaterial& m) const {
        // An interface in a mix lets its share of the light straight through.
        const auto part = [](const Material& material) {
            return is_interface(material) || has_peak(material);
        };
        return part(*m.first) || part(*m.second);
    }
    template <typename Shiny>
    bool operator()(const Shiny&) const {
        return true;
    }
};

struct MayPassStraight {
    bool operator()(const ThinDielectricMaterial&) const { return true; }
    bool operator()(const DielectricMaterial& m) const {
        const auto eta = m.eta.constant_value();
        return !eta || *eta == 1;
    }
    bool operator()(const UberMaterial& m) const { return m.opacity.has_value(); }
    bool operator()(const MixMaterial& m) const {
        const auto part = [](const Material& material) {
            return is_interface(material) || may_pass_straight(material);
        };
        return part(*m.first) || part(*m.second);
    }
    template <typename BendsOrStops>
    bool operator()(const BendsOrStops&) const {
        return false;
    }
};

struct HasDiffuse {
    std::optional<bool> operator()(const DiffuseMaterial&) const { return true; }
    std::optional<bool> operator()(const DiffuseTransmissionMaterial&) const { return true; }
    std::optional<bool> operator()(const CoatedDiffuseMaterial&) const { return true; }
    std::optional<bool> operator()(const SubstrateMaterial&) const { return true; }
    std::optional<bool> operator()(const MirrorMaterial&) const { return false; }
    std::optional<bool> operator()(const ConductorMaterial&) const { return false; }
    std::optional<bool> operator()(const DielectricMaterial&) const { return false; }
    std::optional<bool> operator()(const ThinDielectricMaterial&) const { return false; }
    std::optional<bool> operator()(const CoatedConductorMaterial&) const { return false; }
    std::optional<bool> operator()(const ShinyMetalMaterial&) const { return false; }
    template <typename ByItsTextures>
    std::optional<bool> operator()(const ByItsTextures&) const {
        return std::nullopt;
    }
};

struct MostLobes {
    std::size_t operator()(const DiffuseTransmissionMaterial&) const { return 2; }
    std::size_t operator()(const CoatedDiffuseMaterial&) const { return 2; }
    std::size_t operator()(const CoatedConductorMaterial&) const { return 2; }
    std::size_t operator()(const UberMaterial&) const { return 4; }
    std::size_t operator()(const TranslucentMaterial&) const { return 3; }
    std::size_t operator()(const ShinyMetalMaterial&) const { return 2; }
    std::size_t operator()(const SubstrateMaterial&) const { return 2; }
    std::size_t operator()(const MixMaterial& m) const {
        return most_lobes(*m.first) + most_lobes(*m.second);
    }
    template <typename Single>
    std::size_t operator()(const Single&) const {
        return 1;
    }
};

// Returns the relief of a material; a mix takes that of its first part that has one.
const Relief* relief_of(const Material& material) {
    if (material.relief.displacement || material.relief.normals) return &material.relief;
    const auto* mix = std::get_if<MixMaterial>(&material.model);
    if (!mix) return nullptr;
    const Relief* first = relief_of(*mix->first);
    return first ? first : relief_of(*mix->second);
}

}  // namespace

Bsdf make_bsdf(const Material& material, const Hit& hit, const V3d& origin) {
    assert(!is_interface(material) && "rays pass through an interface; Scene::hit never returns one");
    const TexturePoint point(hit.uv, V3d(hit.at.p) + origin);
    const Relief* relief = relief_of(material);
    V3f ns = hit.ns;
    if (relief) {
        // Evaluating the relief takes long enough for the colour's texels to arrive.
        if (const auto* diffuse = std::get_if<DiffuseMaterial>(&material.model)) {
            diffuse->reflectance.prefetch(point);
        }
        ns = bent_normal(*relief, hit, point);
    }
    if (const auto* diffuse = std::get_if<DiffuseMaterial>(&material.model)) {
        if (const auto sigma = diffuse->sigma.constant_value(); sigma && !(*sigma > 0)) {
            return {DiffuseLobe{as_share(diffuse->reflectance.at(point))}, ns, hit.at.n, hit.dpdu};
        }
    }
    LobeList list;
    add_lobes(material.model, point, list);
    if (list.size() == 1) return {list.all().front(), ns, hit.at.n, hit.dpdu};
    return {list.all(), ns, hit.at.n, hit.dpdu};
}

std::optional<bool> has_diffuse(const Material& material) {
    return std::visit(HasDiffuse{}, material.model);
}

bool is_specular(const Material& material) {
    return std::visit(MayBeDelta{}, material.model);
}

bool may_pass_straight(const Material& material) {
    return std::visit(MayPassStraight{}, material.model);
}
bool has_peak(const Material& material) {
    return std::visit(MayHavePeak{}, material.model);
}

bool is_interface(const Material& material) {
    return std::holds_alternative<InterfaceMaterial>(material.model);
}

std::size_t most_lobes(const Material& material) {
    return std::visit(MostLobes{}, material.model);
}

}  // namespace lucerna
