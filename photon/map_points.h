// Photon maps as points for other programs: a PLY file, binary, in this machine's byte order.
#pragma once

#include <filesystem>

#include "engine/base/vec.h"
#include "photon/build_maps.h"

namespace lucerna {

inline constexpr const char* kMapPointsSuffix = ".ply";

// One vertex for each photon of each map: x, y, z, its place in the scene's lengths; nx, ny, nz, the
// surface's normal there (of photons in media 0); dx, dy, dz, the direction in which it travelled; power_r,
// power_g, power_b [the scene's flux unit], linear, already divided by the number of light paths; map, the
// number of its map (MapKind); light, the index of the light it came from; bounces, those before. Float but
// for the last three. `origin` is the scene's. Replaces the file. Throws InputError.
void write_map_points(const std::filesystem::path& file, const PhotonMaps& maps, const V3d& origin);

}  // namespace lucerna
