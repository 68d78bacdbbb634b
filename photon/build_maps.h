// From lights to maps: emits light paths, traces them, sorts their hits into the maps that are wanted.
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
    int longest = kMaxBounces;  // bounces of a photon's path before it, at the most
    // Whether the Caustic map takes L(S+D)+S+D, too.
    bool caustic_chains = false;
    // Bounces of all paths, on average for each of `paths`, at the most; 0: no bound. Where paths are longer,
    // fewer are emitted, with a warning. Nothing is lost, but there is more noise. Not looked at where a
    // target is set.
    int most_bounces = 0;
    // The maps are to be there by then. If there is not the time, fewer paths are traced than `paths` or the
    // targets ask for.
    Deadline deadline = {};
    // Sets of such maps that are still to be made, with this one: for what memory they need.
    int sets = 1;
    // By which paths are emitted; null: plainly. Outlives the maps' making.
    const LearnedEmission* emission = nullptr;
};

// The numbers of hits of one class that were stored and dropped.
struct DepositCount {
    std::uint64_t stored = 0;
    std::uint64_t not_wanted = 0;    // the map of their class is not built, or does not take them
    std::uint64_t not_storable = 0;  // on mirrors, glass, rough or black surfaces

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

// The same maps, photon by photon, for any number of threads. Stopped early (monitor), the paths not traced
// carry no power: the caller must not use the result.
PhotonMaps build_photon_maps(const Scene& scene, const MapParameters& parameters, const Workers& workers,
                             Monitor& monitor);

// Returns by name all parameters that maps depend on beside the scene. Maps in files are those of
// `photonmap`, which sets neither caustic_chains nor most_bounces and then emits light paths by power: these
// are not among them.
Facts map_facts(const MapParameters& parameters);

// The rays of a photon pass, for measuring: what the pass asks of the scene, without what it makes of it.

// Every ray that build_photon_maps traces for the parameters' `paths` (targets are not looked at), path after
// path. Only for scenes without medium interfaces, whose search for the medium around a vertex traces
// others.
std::vector<Ray> rays_of_light_paths(const Scene& scene, const MapParameters& parameters);

// Photon maps on disk: built once, looked at from many places.

// The scene and the parameters that maps in a file were made for.
struct MapOrigin {
    std::string scene;   // name of its file, to be shown
    std::string unit;    // of flux
    V3d place{0, 0, 0};  // world position of the photons' (0,0,0)
    Facts facts;  // of the scene and map_facts(): maps serve renders of which all of these are the same
};

// Where a render takes its maps from and where it leaves them; empty: builds them, leaves none.
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

// The same maps, photon by photon; indexed anew. Throws InputError if the file is damaged or its facts are
// not these, or if it names a light beyond `lights`.
PhotonMaps load_maps(const std::filesystem::path& file, const Facts& facts, std::size_t lights,
                     IndexKind index, const Workers& workers);

}  // namespace lucerna
