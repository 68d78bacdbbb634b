// Photons whose irradiance is known.
#pragma once

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/scene.h"
#include "photon/photon_map.h"
#include "tests/support/lobes.h"

namespace lucerna::testing {

inline Hit floor_hit(const V3f& p) {
    Hit hit;
    hit.at = {p, kUp, surface_error(p, 1)};
    hit.ns = kUp;
    hit.dpdu = V3f(1, 0, 0);
    return hit;
}

inline Bsdf white() {
    return Bsdf(DiffuseLobe{Rgb(1.0F)}, kUp, kUp, V3f(1, 0, 0));
}

inline Photon photon(const V3f& d, float power) {
    return {PackedDirection(d), Rgb(power), 0, kNoCell};
}

// Returns n photons of total power 1 on the unit square z = 0, arriving from a cosine-distributed sky:
// irradiance 1.
inline PhotonMap uniform_map(int n, std::uint64_t seed) {
    Sampler sampler(seed, Purpose::test, 0, 0);
    Photons deposited;
    for (int i = 0; i < n; ++i) {
        const V3f p(sampler.next(), sampler.next(), 0);
        deposited.add(p, PackedDirection(kUp),
                      photon(-square_to_cosine_hemisphere(sampler.next2()), 1.0F / static_cast<float>(n)));
    }
    return PhotonMap(deposited, IndexKind::tree, Workers{1});  // many small maps: threads are overhead
}

}  // namespace lucerna::testing
