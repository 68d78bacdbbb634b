#include "photon/near_photons.h"

#include <algorithm>

namespace lucerna {

NearPhotons::NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k,
                         float most2)
    : nearest_(std::min(k, map.size()) + 1, most2), radius2_(most2) {  // one more than k: it fixes the radius
    map.index().nearest(x, metric, nearest_);
    found_ = nearest_.sorted();
    if (found_.size() > std::min(k, map.size())) {
        radius2_ = found_.back().key;
        found_ = found_.first(found_.size() - 1);
    }
}

}  // namespace lucerna
