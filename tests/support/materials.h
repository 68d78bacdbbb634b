// Materials of every kind, with all their variants, for tests that apply to each of them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/material.h"
#include "engine/scene/scene.h"
#include "tests/support/lobes.h"

namespace lucerna::testing {

inline RgbTexture color(float r, float g, float b) {
    return RgbTexture::constant(Rgb(r, g, b));
}
inline RgbTexture grey(float x) {
    return color(x, x, x);
}

inline Coat varnish(float eta, float alpha_x, float alpha_y) {
    Coat coat{eta, Roughness::of_alpha(alpha_x, alpha_y), nullptr};
    coat.table = std::make_shared<CoatTable>(eta, coat.roughness.constant_alpha());
    return coat;
}
inline CoatedDiffuseMaterial coated(const RgbTexture& reflectance, float alpha, float eta = 1.5F) {
    return {reflectance, varnish(eta, alpha, alpha)};
}
inline UberMaterial uber(const RgbTexture& diffuse, const RgbTexture& gloss, float alpha_x, float alpha_y) {
    UberMaterial material;
    material.diffuse = diffuse;
    material.gloss = gloss;
    material.roughness = Roughness::of_alpha(alpha_x, alpha_y);
    material.table = std::make_shared<CoatTable>(1.5F, material.roughness.constant_alpha());
    return material;
}
inline ConductorMaterial rough_copper(float alpha) {
    ConductorMaterial metal;
    metal.roughness = Roughness::of_alpha(alpha);
    return metal;
}
inline MixMaterial mix(MaterialModel first, MaterialModel second, float share) {
    return {std::make_shared<Material>(Material{"first", std::move(first)}),
            std::make_shared<Material>(Material{"second", std::move(second)}), FloatTexture::constant(share)};
}

struct Sample {
    std::string name;
    // Made on demand, because the tables of varnish take half a second for all materials, and every test of a
    // program lists them all.
    std::function<MaterialModel()> model;
    float width = 0.3F;  // width of the narrowest rough lobe
    float eta = 1;       // index of its microfacet transmission, inside over outside

    Material material() const { return {name, model()}; }
};

// Returns materials that together reach every branch of the code that makes lobes.
inline std::vector<Sample> all_materials() {
    const auto full_uber = [] {
        UberMaterial full = uber(color(0.9F, 0.5F, 0.3F), grey(0.4F), 0.2F, 0.2F);
        full.reflect = grey(0.5F);
        full.transmit = color(0.2F, 0.3F, 0.9F);
        full.opacity = color(0.5F, 0.7F, 1);
        return full;
    };
    const auto full_uber_without_table = [full_uber] {
        UberMaterial full = full_uber();
        full.table = nullptr;
        return full;
    };
    return {
        {"matte", [] { return DiffuseMaterial{color(0.1F, 0.5F, 1)}; }},
        {"matte_sigma10",
         [] {
             return DiffuseMaterial{grey(1), FloatTexture::constant(10)};
         }},
        {"matte_sigma60",
         [] {
             return DiffuseMaterial{color(1, 0.5F, 0.2F), FloatTexture::constant(60)};
         }},
        {"diffusetransmission",
         [] {
             return DiffuseTransmissionMaterial{color(0.3F, 0.9F, 1), color(0.3F, 0.9F, 0), 1};
         }},
        {"thindielectric", [] { return ThinDielectricMaterial{}; }},
        {"coateddiffuse_smooth", [] { return coated(color(1, 0.5F, 0.1F), 0); }},
        {"coateddiffuse_0_1", [] { return coated(color(1, 0.5F, 0.1F), 0.1F); }, 0.1F},
        {"coateddiffuse_0_5", [] { return coated(color(1, 0.5F, 0.1F), 0.5F); }},
        {"coateddiffuse_brushed",
         [] {
             return CoatedDiffuseMaterial{grey(1), varnish(1.7F, 0.1F, 0.5F)};
         },
         0.1F},
        {"coatedconductor_smooth",
         [] {
             return CoatedConductorMaterial{varnish(1.5F, 0, 0), {}};
         }},
        {"coatedconductor_0_1",
         [] {
             return CoatedConductorMaterial{varnish(1.5F, 0.1F, 0.1F), rough_copper(0.2F)};
         },
         0.1F},
        {"coatedconductor_half_smooth",
         [] {
             return CoatedConductorMaterial{varnish(1.5F, 0, 0), rough_copper(0.3F)};
         }},
        {"plastic_dim", [] { return uber(color(0.1F, 0.5F, 0.2F), grey(0.4F), 0.1F, 0.1F); }, 0.1F},
        {"plastic_bright", [] { return uber(color(0.1F, 1, 0), grey(0.8F), 0.2F, 0.2F); }, 0.2F},
        {"plastic_brushed", [] { return uber(grey(1), grey(1), 0.05F, 0.4F); }, 0.05F},
        {"uber_full", full_uber, 0.2F},
        {"uber_without_table", full_uber_without_table, 0.2F},
        {"substrate_0_05",
         [] {
             return SubstrateMaterial{color(1, 0.5F, 0.2F), color(0.05F, 0.5F, 1),
                                      Roughness::of_alpha(0.05F)};
         },
         0.05F},
        {"substrate_1",
         [] {
             return SubstrateMaterial{grey(1), color(0, 0.5F, 1), Roughness::of_alpha(1)};
         }},
        {"substrate_brushed",
         [] {
             return SubstrateMaterial{grey(0.5F), grey(0.2F), Roughness::of_alpha(0.1F, 0.6F)};
         },
         0.1F},
        {"translucent", [] { return TranslucentMaterial{}; }, 0.1F, 1.5F},
        {"translucent_bright",
         [] {
             return TranslucentMaterial{grey(1), grey(0.5F), grey(0.5F), grey(1), Roughness::of_alpha(0.3F)};
         },
         0.3F, 1.5F},
        {"shinymetal",
         [] {
             return ShinyMetalMaterial{color(0.3F, 1, 0.2F), color(0.3F, 1, 0), Roughness::of_alpha(0.2F)};
         },
         0.2F},
        {"mix", [] { return mix(coated(grey(0.8F), 0.2F), rough_copper(0.1F), 0.3F); }, 0.1F},
        {"mix_with_nothing", [] { return mix(InterfaceMaterial{}, SubstrateMaterial{}, 0.6F); }, 0.1F},
        {"mix_of_four",
         [full_uber_without_table] {
             return mix(full_uber_without_table(), uber(grey(0.3F), grey(0.3F), 0.1F, 0.1F), 0.5F);
         },
         0.1F},
    };
}

inline Hit flat_hit() {
    Hit hit;
    hit.at.n = hit.ns = kUp;
    hit.dpdu = kAlongX;
    hit.dpdv = V3f(0, 1, 0);
    return hit;
}

}  // namespace lucerna::testing
