// The photons near a point: the one search that every estimate, gate and guide is made of.
#pragma once

#include <span>

#include "kdtree/nearest.h"
#include "photon/photon_map.h"
#include "photon/tangent_metric.h"

namespace lucerna {

// The k nearest photons by the tangent metric, and what radius they fill. Searched on construction; for one
// thread, on its stack.
class NearPhotons {
  public:
    // k >= 1; `most2` > 0 is the largest squared distance. `x` is the metric's own point.
    NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k, float most2);

    // Nearest first; ties by index, so that the order, and what is summed in it, does not depend on the
    // search. Keys are squared distances.
    std::span<const Neighbour> found() const { return found_; }
    // The squared distance of the next one beyond the k; `most2` if there are no more than k.
    float radius2() const { return radius2_; }

  private:
    Nearest nearest_;
    std::span<const Neighbour> found_;
    float radius2_;
};

}  // namespace lucerna
