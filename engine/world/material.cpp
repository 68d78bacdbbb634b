#include "engine/world/material.h"

#include <cassert>

#include "engine/world/scene.h"

namespace lucerna {
namespace {

struct MakeLobe {
    V2f uv;

    Lobe operator()(const DiffuseMaterial& m) const { return DiffuseLobe{m.reflectance.at(uv)}; }
    Lobe operator()(const MirrorMaterial& m) const { return MirrorLobe{m.reflectance.at(uv)}; }
    Lobe operator()(const ConductorMaterial& m) const {
        return ConductorLobe{m.eta, m.k, m.tint, m.alpha_x, m.alpha_y};
    }
    Lobe operator()(const DielectricMaterial& m) const {
        return DielectricLobe{m.eta, m.reflect, m.transmit, m.alpha_x, m.alpha_y};
    }
    Lobe operator()(const InterfaceMaterial&) const {
        assert(false && "rays pass through an interface; Scene::hit never returns one");
        return BlackLobe{};
    }
};

}  // namespace

Bsdf make_bsdf(const Material& material, const Hit& hit) {
    return {std::visit(MakeLobe{hit.uv}, material.model), hit.ns, hit.at.n, hit.dpdu};
}

bool is_specular(const Material& material) {
    // Whether a lobe is a delta does not depend on where it is met.
    Hit hit;
    hit.at.n = hit.ns = V3f(0, 0, 1);
    hit.dpdu = V3f(1, 0, 0);
    return !is_interface(material) && make_bsdf(material, hit).is_delta();
}

bool is_interface(const Material& material) {
    return std::holds_alternative<InterfaceMaterial>(material.model);
}

}  // namespace lucerna
