// Builds photon maps: emits light paths, traces them and stores their hits in the requested maps.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/deadline.h"
#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/text/facts.h"
#include "photon/deposit.h"
#include "photon/photon_map.h"

namespace lucerna {

struct MapParameters {
    std::int64_t paths = 0;  // light paths to emit, 1 to 2^32; their number has no effect if a target is set
    std::array<bool, kMapKinds> wanted{};
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    // Least number of photons to store, by map; 0: no target. A target that would need too many paths is
    // abandoned with a warning.
    std::array<std::int64_t, kMapKinds> targets = {};
    bool volume_direct = false;  // whether the Volume map also takes photons straight from a light
    IndexKind index = IndexKind::tree;
    // Bounces off lobes of a smaller GGX alpha count as specular; 0: delta lobes alone.
    float specular_below = 0;
    int longest = kMaxBounces;  // largest number of bounces before a photon
    // Whether the Caustic map also takes L(S+D)+S+D.
    bool caustic_chains = false;
    // Bounds the mean number of bounces per path of `paths`; 0: no bound. If paths are longer, fewer of them
    // are emitted, with a warning: the result stays unbiased but has more noise. Has no effect if a target is
    // set.
    int most_mean_bounces = 0;
    // Time by which the maps must be complete. If it is short, fewer paths are traced than `paths` or the
    // targets ask for.
    Deadline deadline = {};
    // Number of sets of maps still to be built, including this one; the memory check counts all of them.
    int sets = 1;
    // Density from which paths are emitted; null: by the lights' power. Must outlive the construction of the
    // maps.
    const LearnedEmission* emission = nullptr;
};

// The numbers of hits of one class that were stored and dropped.
struct DepositCount {
    std::uint64_t stored = 0;
    std::uint64_t not_wanted = 0;    // the map of their class is not built or does not take them
    std::uint64_t not_storable = 0;  // on surfaces without a diffuse part: mirrors, glass, rough metal, black

    void add(const DepositCount& more) {
        stored += more.stored;
        not_wanted += more.not_wanted;
        not_storable += more.not_storable;
    }
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

// Builds the same maps, photon by photon, for any number of threads. If the monitor stops it early, untraced
// paths carry no power and the caller must not use the result.
PhotonMaps build_photon_maps(const Scene& scene, const MapParameters& parameters, const Workers& workers,
                             Monitor& monitor);

// Returns by name all parameters that maps depend on beside the scene. Maps in files are those of
// `photonmap`, which sets neither caustic_chains nor most_mean_bounces and then emits light paths by power:
// these are not among them.
Facts map_facts(const MapParameters& parameters);

// Rays of a photon pass, for measuring ray tracing apart from shading and storing.

// Returns every ray that build_photon_maps traces for the parameters' `paths` (targets are ignored), path by
// path. Valid only for scenes without medium interfaces, whose search for the medium around a vertex traces
// further rays.
std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapParameters& parameters);

// Photon maps on disk, built once and rendered from many viewpoints.

// The scene and the parameters that maps in a file were made for.
struct MapOrigin {
    std::string scene;   // name of its file, for display
    std::string unit;    // of flux
    V3d place{0, 0, 0};  // world position of the photons' (0,0,0)
    Facts facts;  // of the scene and map_facts(); all must match those of the render that loads the maps
};

// Files from which a render loads its maps and to which it saves them; empty: it builds them and saves none.
struct MapFiles {
    std::filesystem::path load, save;
    // Name and facts of the rendered scene; render() fills them in.
    std::string scene = {};
    Facts scene_facts = {};

    bool any() const { return !load.empty() || !save.empty(); }
};

// The fact of the scene that names the working space of the photons' power.
inline constexpr std::string_view kColourSpaceFact = "colour space";

inline constexpr const char* kMapsSuffix = ".photons";

// Replaces the file. Throws InputError.
void save_maps(const std::filesystem::path& file, const PhotonMaps& maps, const MapOrigin& origin);

// The content of a file, whatever it was made for.
struct SavedMaps {
    MapOrigin origin;
    std::array<std::optional<Photons>, kMapKinds> maps;
    std::array<DepositCount, kMapKinds> counts{};
    Ledger ledger;
};
// Throws InputError if the file is damaged.
SavedMaps read_maps(const std::filesystem::path& file);

// Loads the saved maps, photon by photon, and builds their index. Throws InputError if the file is damaged,
// if its facts differ from `facts` or if it names a light beyond `lights`.
PhotonMaps load_maps(const std::filesystem::path& file, const Facts& facts, std::size_t lights,
                     IndexKind index, const Workers& workers);

}  // namespace lucerna
