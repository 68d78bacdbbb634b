// How far one must look for k photons: known at some photons of a map, looked up anywhere.
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
        // Photons of the map, at most, spread evenly over them, that learn a radius.
        std::size_t points = 8192;
        // Where the light is even, up to kWider times as many photons as k. Without it k everywhere.
        bool wider_where_even = false;
        // Asked, if not null, where discs are whole: see At.
        const Scene* scene = nullptr;
        std::uint64_t seed = 0;  // of what is asked
    };
    // The radius of each point is that of the k nearest of all photons, the point's own left out, or the
    // largest where there are fewer.
    LocalRadius(const PhotonMap& map, const Parameters& parameters, const Workers& workers);

    struct At {
        float radius;  // scene units, > 0
        // Nothing cuts off a disc of that radius or a smaller one, and nothing stands between it and light:
        // its boundary needs no correction, as far as rays could tell.
        bool whole;
    };
    // Returns the radius at the nearest point on the side of n (unit), or the largest radius if none is that
    // near.
    At at(const V3f& x, const V3f& n) const;
    // Over the points; the largest radius if there are none.
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
