// Irradiance computed ahead of time where photons lie, so that a gather ray needs one look-up instead of an
// estimate.
//
// Source: Christensen, "Faster Photon Map Global Illumination", 1999. Radiosity changes slowly, and what a
// gather ray meets is averaged over a hemisphere: the value at the nearest of these points, on the same side
// of a surface of about the same normal, is as good as an estimate of its own.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/gather.h"

namespace lucerna {

class IrradiancePoints {
  public:
    // Estimates at every `stride`-th photon (>= 1) of the first map, spread evenly since a map is ordered in
    // space. The irradiance is that of all maps together (one at least); the radius is that of the first
    // one's estimate.
    IrradiancePoints(std::span<const PhotonMap* const> maps, const GatherSettings& settings,
                     std::size_t stride, const Workers& workers, Monitor& monitor);

    struct Found {
        Rgb irradiance;  // W/m²
        float radius;    // of the estimate, scene units
    };
    // The nearest point within `radius` whose normal is within some 25° of n. None: estimate it yourself.
    std::optional<Found> nearest(const V3f& x, const V3f& n, float radius) const;

    std::size_t size() const { return positions_.size(); }

  private:
    struct Value {
        PackedDirection normal;
        Rgb irradiance;
        float radius;
    };
    std::vector<V3f> positions_;
    std::vector<Value> values_;
    std::unique_ptr<PhotonIndex> index_;  // by their normals
};

}  // namespace lucerna
