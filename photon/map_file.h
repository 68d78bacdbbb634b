// Photon maps on disk: built once, looked at from many places.
#pragma once

#include <cstdint>
#include <filesystem>

#include "photon/build_maps.h"

namespace lucerna {

// Where a render takes its maps from and where it leaves them; empty: builds them, leaves none.
struct MapFiles {
    std::filesystem::path load, save;

    bool any() const { return !load.empty() || !save.empty(); }
};

// Replaces the file. `key` is map_key()'s. Throws InputError.
void save_maps(const std::filesystem::path& file, const PhotonMaps& maps, std::uint64_t key);

// The same maps, photon by photon; indexed anew. Throws InputError if the file is damaged or of another key,
// or names a light beyond `lights`.
PhotonMaps load_maps(const std::filesystem::path& file, std::uint64_t key, std::size_t lights,
                     IndexKind index, const Workers& workers);

}  // namespace lucerna
