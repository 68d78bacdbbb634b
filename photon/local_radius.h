// Estimates the radius that holds k photons: computed at some photons of a map, looked up anywhere.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/base/parallel.h"
#include "engine/scene/scene.h"
#include "photon/density_estimate.h"
#include "photon/photon_map.h"

namespace lucerna {

class LocalRadius {
  public:
    struct Parameters {
        DensityEstimateSettings how;  // k, the largest radius, the metric
        // Largest number of photons of the map, spread evenly over them, at which radii are computed.
        std::size_t points = 8192;
        // Uses up to kWider times as many photons as k where the light is even; otherwise k everywhere.
        bool wider_where_even = false;
        // If not null, rays in this scene find where discs are complete; see At.
        const Scene* scene = nullptr;
        std::uint64_t seed = 0;  // of these rays
    };
    // Computes the radius of each point, that of the k nearest photons other than the point's own, or the
    // largest radius if there are fewer.
    LocalRadius(const PhotonMap& map, const Parameters& parameters, const Workers& workers);

    struct At {
        float radius;  // scene units, > 0
        // No edge and no occluder cuts off a disc of that radius or a smaller one, so its boundary needs no
        // correction, as far as a few rays can tell.
        bool whole;
    };
    // Returns the radius at the nearest point on the side of n (unit), or the largest radius if none is that
    // near.
    At at(const V3f& x, const V3f& n) const;
    // Returns the mean over the points, or the largest radius if there are none.
    double mean() const;

    static constexpr int kWider = 4;

  private:
    float find_radius(const PhotonMap& map, const Parameters& parameters, std::size_t point) const;
    bool find_whole(const PhotonMap& map, const Parameters& parameters, std::size_t point) const;

    PhotonMap places_;
    std::vector<float> radii_;         // of each place
    std::vector<std::uint8_t> whole_;  // of each place
    float largest_;
};

}  // namespace lucerna
