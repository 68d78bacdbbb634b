// What surfaces are made of: the scene's description, turned into a Bsdf for each hit.
#pragma once

#include <string>
#include <variant>

#include "engine/base/vec.h"
#include "engine/world/bsdf.h"
#include "engine/world/texture.h"

namespace lucerna {

struct DiffuseMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.5F));
};
struct MirrorMaterial {
    RgbTexture reflectance = RgbTexture::constant(Rgb(0.9F));
};
// Defaults: copper. `alpha` is GGX's; 0 is smooth.
struct ConductorMaterial {
    Rgb eta{0.200F, 0.924F, 1.102F};
    Rgb k{3.912F, 2.452F, 2.142F};
    Rgb tint{1.0F};
    float alpha_x = 0, alpha_y = 0;
};
struct DielectricMaterial {
    float eta = 1.5F;
    Rgb reflect{1.0F}, transmit{1.0F};
    float alpha_x = 0, alpha_y = 0;
};
// Not there: rays pass through (pbrt's "interface" or "").
struct InterfaceMaterial {};

using MaterialModel =
    std::variant<DiffuseMaterial, MirrorMaterial, ConductorMaterial, DielectricMaterial, InterfaceMaterial>;

struct Material {
    std::string name;
    MaterialModel model;
};

struct Hit;
// Hits on an interface have no Bsdf; Scene::hit never returns them.
Bsdf make_bsdf(const Material& material, const Hit& hit);

// True if the material has a delta lobe (whether there are caustics to trace).
bool is_specular(const Material& material);
bool is_interface(const Material& material);

}  // namespace lucerna
