// Writes photon maps as points for other programs: a binary PLY file in this machine's byte order.
#pragma once

#include <filesystem>

#include "engine/base/vec.h"
#include "photon/build_maps.h"

namespace lucerna {

inline constexpr const char* kMapPointsSuffix = ".ply";

// Writes one vertex for each photon of each map: x, y, z, its position in the scene's length unit; nx, ny,
// nz, the surface normal there (0 for photons in media); dx, dy, dz, its direction of travel; power_r,
// power_g, power_b [the scene's flux unit], linear, already divided by the number of light paths; light, the
// index of its light; map, the number of its map (MapKind); bounces, the number of bounces before it. All are
// floats except the last three. `origin` is that of the scene. Replaces the file. Throws InputError.
void write_map_points(const std::filesystem::path& file, const PhotonMaps& maps, const V3d& origin);

}  // namespace lucerna
