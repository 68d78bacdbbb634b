#include "photon/fixed_gather.h"

#include <algorithm>

namespace lucerna {

GatherResult gather_within(const PhotonMap& map, const GatherSettings& settings, float radius, const Hit& hit,
                           const Bsdf& bsdf, const V3f& wo) {
    GatherSettings all = settings;
    all.k = 0;
    all.radius = std::max(radius, hit.at.error);
    return Gather(map, all).radiance(hit, bsdf, wo);
}

}  // namespace lucerna
