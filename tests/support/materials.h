// One of every material, in all its ways, for tests that ask the same of each.
#pragma once

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
    Material material;
    float width = 0.3F;  // of its narrowest rough lobe
    float eta = 1;       // of what it transmits through facets, inside over outside
};

// Materials in every branch of the code that makes their lobes.
inline std::vector<Sample> all_materials() {
    std::vector<Sample> all;
    const auto add = [&](const std::string& name, MaterialModel model, float width = 0.3F, float eta = 1) {
        all.push_back({name, {name, std::move(model)}, width, eta});
    };
    add("matte", DiffuseMaterial{color(0.1F, 0.5F, 1)});
    add("matte_sigma10", DiffuseMaterial{grey(1), FloatTexture::constant(10)});
    add("matte_sigma60", DiffuseMaterial{color(1, 0.5F, 0.2F), FloatTexture::constant(60)});
    add("diffusetransmission", DiffuseTransmissionMaterial{color(0.3F, 0.9F, 1), color(0.3F, 0.9F, 0), 1});
    add("thindielectric", ThinDielectricMaterial{});
    add("coateddiffuse_smooth", coated(color(1, 0.5F, 0.1F), 0));
    add("coateddiffuse_0_1", coated(color(1, 0.5F, 0.1F), 0.1F), 0.1F);
    add("coateddiffuse_0_5", coated(color(1, 0.5F, 0.1F), 0.5F));
    add("coateddiffuse_brushed", CoatedDiffuseMaterial{grey(1), varnish(1.7F, 0.1F, 0.5F)}, 0.1F);
    add("coatedconductor_smooth", CoatedConductorMaterial{varnish(1.5F, 0, 0), {}});
    add("coatedconductor_0_1", CoatedConductorMaterial{varnish(1.5F, 0.1F, 0.1F), rough_copper(0.2F)}, 0.1F);
    add("coatedconductor_half_smooth", CoatedConductorMaterial{varnish(1.5F, 0, 0), rough_copper(0.3F)});
    add("plastic_dim", uber(color(0.1F, 0.5F, 0.2F), grey(0.4F), 0.1F, 0.1F), 0.1F);
    add("plastic_bright", uber(color(0.1F, 1, 0), grey(0.8F), 0.2F, 0.2F), 0.2F);
    add("plastic_brushed", uber(grey(1), grey(1), 0.05F, 0.4F), 0.05F);
    UberMaterial full = uber(color(0.9F, 0.5F, 0.3F), grey(0.4F), 0.2F, 0.2F);
    full.reflect = grey(0.5F);
    full.transmit = color(0.2F, 0.3F, 0.9F);
    full.opacity = color(0.5F, 0.7F, 1);
    add("uber_full", full, 0.2F);
    full.table = nullptr;
    add("uber_without_table", full, 0.2F);
    add("substrate_0_05",
        SubstrateMaterial{color(1, 0.5F, 0.2F), color(0.05F, 0.5F, 1), Roughness::of_alpha(0.05F)}, 0.05F);
    add("substrate_1", SubstrateMaterial{grey(1), color(0, 0.5F, 1), Roughness::of_alpha(1)});
    add("substrate_brushed", SubstrateMaterial{grey(0.5F), grey(0.2F), Roughness::of_alpha(0.1F, 0.6F)},
        0.1F);
    add("translucent", TranslucentMaterial{}, 0.1F, 1.5F);
    add("translucent_bright",
        TranslucentMaterial{grey(1), grey(0.5F), grey(0.5F), grey(1), Roughness::of_alpha(0.3F)}, 0.3F, 1.5F);
    add("shinymetal", ShinyMetalMaterial{color(0.3F, 1, 0.2F), color(0.3F, 1, 0), Roughness::of_alpha(0.2F)},
        0.2F);
    add("mix", mix(coated(grey(0.8F), 0.2F), rough_copper(0.1F), 0.3F), 0.1F);
    add("mix_with_nothing", mix(InterfaceMaterial{}, SubstrateMaterial{}, 0.6F), 0.1F);
    add("mix_of_four", mix(full, uber(grey(0.3F), grey(0.3F), 0.1F, 0.1F), 0.5F), 0.1F);
    return all;
}

inline Hit flat_hit() {
    Hit hit;
    hit.at.n = hit.ns = kUp;
    hit.dpdu = kAlongX;
    hit.dpdv = V3f(0, 1, 0);
    return hit;
}

}  // namespace lucerna::testing
