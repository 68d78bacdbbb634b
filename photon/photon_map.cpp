#include "photon/photon_map.h"

#include <cstdint>

namespace lucerna {

PhotonMap::PhotonMap(const Photons& landed, IndexKind index, const Workers& workers) : kind_(index) {
    // Neighbours in space become neighbours in memory: a search reads them straight through.
    const std::vector<std::uint32_t> order = box_order(landed.positions, workers);
    all_.positions.resize(order.size());
    all_.normals.resize(order.size());
    all_.photons.resize(order.size());
    std::vector<PackedDirection> directions(order.size());
    constexpr std::int64_t kGrain = 1 << 14;
    parallel_ranges(workers, static_cast<std::int64_t>(order.size()), kGrain,
                    [&](std::int64_t begin, std::int64_t end, std::int64_t) {
                        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end);
                             ++i) {
                            const std::uint32_t old = order[i];
                            all_.positions[i] = landed.positions[old];
                            all_.normals[i] = landed.normals[old];
                            all_.photons[i] = landed.photons[old];
                            directions[i] = landed.photons[old].direction;
                        }
                    });
    index_ = make_photon_index(index, all_.positions, directions, workers);
}

}  // namespace lucerna
