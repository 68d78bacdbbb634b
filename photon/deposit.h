// Which hit enters which map [Jensen 2001, 9; Goesele 2003, 5.2]:
//
//   Direct   LD             the first impact straight from a light
//   Caustic  LS+D           after specular bounces only
//   Global   L(S|D)*D(S|D)*D  after at least one diffuse bounce
//   Volume   where a medium scatters, whatever came before
//
// If asked for, the Caustic map also takes L(S+D)+S+D from the Global map: caustics of surfaces that are
// themselves lit by caustics and nothing else.
//
// Scattering in a medium counts as D: what it sends to a surface is indirect light. Photons of
// the Volume map that come straight from a light can be left out, for methods that sample the lights along a
// ray.
#pragma once

#include <cstdint>
#include <string_view>

#include "photon/light_path.h"

namespace lucerna {

enum class MapKind : std::uint8_t { direct, global, caustic, volume };
inline constexpr int kMapKinds = 4;

inline std::string_view map_name(MapKind kind) {
    constexpr std::string_view names[] = {"direct", "global", "caustic", "volume"};
    return names[static_cast<int>(kind)];
}

// Returns the map of a hit on a surface.
inline MapKind map_of(const PathClass& path, bool caustic_chains = false) {
    if (caustic_chains && path.specular_last && !path.left_caustic_chain) return MapKind::caustic;
    if (path.non_specular > 0) return MapKind::global;
    return path.specular > 0 ? MapKind::caustic : MapKind::direct;
}

// Photons lie on surfaces with a diffuse part, and are used in density estimates for that part alone. Gloss,
// rough metal and glass reflect too little of what an estimate would find, and renderers follow the ray there
// instead.
inline bool stores_photons(const Bsdf& bsdf) {
    return bsdf.has_diffuse();
}
// The same without looking at textures where the material tells.
inline bool stores_photons(const Scene& scene, const Hit& hit) {
    const auto always = has_diffuse(scene.materials()[hit.material]);
    return always ? *always : stores_photons(scene.bsdf(hit));
}

}  // namespace lucerna
