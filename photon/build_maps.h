// From lights to maps: emits light paths, traces them, sorts their hits into the maps that are wanted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/deposit.h"
#include "photon/photon_map.h"

namespace lucerna {

struct MapParameters {
    std::int64_t paths = 0;  // light paths to emit, at most 2^32; not looked at where a target is set
    std::array<bool, kMapKinds> wanted{};
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    // Photons to store at least, by map; 0: no target. A target that too few paths serve is given up, with a
    // warning.
    std::array<std::int64_t, kMapKinds> targets = {};
    bool volume_direct = false;  // whether the Volume map also takes photons straight from a light
    IndexKind index = IndexKind::tree;
    // Bounces off lobes of a smaller GGX alpha count as specular; 0: deltas alone.
    float specular_below = 0;
    // Whether the Caustic map takes L(S+D)+S+D, too.
    bool caustic_chains = false;
    // Bounces of all paths, on average for each of `paths`, at the most; 0: no bound. Where paths are longer,
    // fewer are emitted, with a warning. Nothing is lost, but there is more noise. Not looked at where a
    // target is set.
    int most_bounces = 0;
    // By which paths are emitted; null: plainly. Outlives the maps' making.
    const LearnedEmission* emission = nullptr;
};

// What became of the hits of one class.
struct DepositCount {
    std::uint64_t stored = 0;
    std::uint64_t not_wanted = 0;    // the map of their class is not built, or does not take them
    std::uint64_t not_storable = 0;  // on mirrors, glass, rough or black surfaces
};

struct PhotonMaps {
    std::array<std::optional<PhotonMap>, kMapKinds> maps;
    std::array<DepositCount, kMapKinds> counts{};
    Ledger ledger;  // in W: already divided by the number of paths
    double seconds_trace = 0, seconds_index = 0;

    const PhotonMap* find(MapKind kind) const {
        const auto& map = maps[static_cast<std::size_t>(kind)];
        return map ? &*map : nullptr;
    }
};

// The same maps, photon by photon, for any number of threads. Stopped early (monitor), the paths not traced
// carry no power: the caller must not use the result.
PhotonMaps build_photon_maps(const Scene& scene, const MapParameters& parameters, const Workers& workers,
                             Monitor& monitor);

// Names the maps that these parameters make of a scene. As a scene has no name, what it does with its first
// light paths stands for it: a change that none of some thousand paths meets is not seen.
std::uint64_t map_key(const Scene& scene, const MapParameters& parameters);

}  // namespace lucerna
