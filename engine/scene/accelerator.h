// Finds the surface that a ray meets first, by Embree, which only accelerator.cpp uses.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/shape_set.h"

namespace lucerna {

// Returns the major version of Embree. Hits of different versions differ in their last bits.
int embree_version();

class Accelerator {
  public:
    struct Placed {
        std::uint32_t prototype;
        InstancePlacement placement;
    };
    // All three arguments must outlive the accelerator and keep their addresses. `origin` is the world
    // position of (0,0,0), which the textures of cut-outs need.
    Accelerator(const ShapeSet& world, const std::vector<ShapeSet>& prototypes,
                const std::vector<Placed>& instances, const V3d& origin, int threads);
    ~Accelerator();
    Accelerator(Accelerator&&) = delete;
    Accelerator& operator=(Accelerator&&) = delete;

    // Finds the nearest surface of these layers at 0 < t <= ray.t_max; leaves `closest` unchanged if there is
    // none. The ray must be finite. A shadow ray meets cut-outs as shadows do (shadow_alpha).
    void nearest(const Ray& ray, unsigned layers, std::optional<ClosestHit>& closest,
                 bool shadow = false) const;
    // Tells whether a shadow ray meets any surface of these layers.
    bool occluded(const Ray& ray, unsigned layers) const;

    // Returns how many of the rays meet a surface of these layers, by Embree alone without surface
    // evaluation. It serves to measure the engine's own overhead.
    std::uint64_t count_hits(std::span<const Ray> rays, unsigned layers) const;

    // Returns the memory that Embree holds, bytes.
    std::uint64_t bytes() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace lucerna
