// Decides which hit enters which photon map [Jensen 2001, 9; Goesele 2003, 5.2]:
//
//   Direct   LD               the first hit of a path, straight from a light
//   Caustic  LS+D             after specular bounces only
//   Global   L(S|D)*D(S|D)*D  after at least one diffuse bounce
//   Volume                    scattering in a medium, after any bounces
//
// On request the Caustic map takes L(S+D)+S+D from the Global map, too: caustics on surfaces that are lit by
// caustics and nothing else.
//
// Scattering in a medium counts as D: the light that it sends to a surface is indirect. Photons of the Volume
// map that come straight from a light can be left out, for methods that sample the lights along a ray.
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

// Photons are stored on surfaces with a diffuse part, and density estimates use them for that part alone.
// Glossy lobes and rough metal would reflect few of the photons around a point, so renderers trace rays there
// instead.
inline bool stores_photons(const Bsdf& bsdf) {
    return bsdf.has_diffuse();
}
// Avoids reading textures if the material alone decides.
inline bool stores_photons(const Scene& scene, const Hit& hit) {
    const auto always = has_diffuse(scene.materials()[hit.material]);
    return always ? *always : stores_photons(scene.bsdf(hit));
}

}  // namespace lucerna
