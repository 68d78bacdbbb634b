// How far one must look for k photons: known at some photons of a map, looked up anywhere.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/base/parallel.h"
#include "photon/density_estimate.h"

namespace lucerna {

class LocalRadius {
  public:
    // At most some `points` of the map's photons, spread evenly over them, learn the radius that `how` finds:
    // that of the k nearest, the photon itself left out, or the largest where there are fewer.
    LocalRadius(const PhotonMap& map, const DensityEstimateSettings& how, std::size_t points,
                const Workers& workers);

    // The radius at the nearest of these photons on n's side (unit), scene units, > 0; the largest radius
    // where none is that near.
    float at(const V3f& x, const V3f& n) const;
    // Over these photons; the largest radius if there are none.
    double mean() const;

  private:
    PhotonMap places_;
    std::vector<float> radii_;  // of each place
    float largest_;
};

}  // namespace lucerna
