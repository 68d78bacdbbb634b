// Which surface a ray meets first: Embree behind a small face. Only accelerator.cpp names Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/shape_set.h"

namespace lucerna {

class Accelerator {
  public:
    struct Placed {
        std::uint32_t prototype;
        InstancePlacement placement;
    };
    // All three must outlive the accelerator and stay where they are. `origin` is the world position of
    // (0,0,0), for textures of cut-outs.
    Accelerator(const ShapeSet& world, const std::vector<ShapeSet>& prototypes,
                const std::vector<Placed>& instances, const V3d& origin, int threads);
    ~Accelerator();
    Accelerator(Accelerator&&) = delete;
    Accelerator& operator=(Accelerator&&) = delete;

    // The nearest surface of these layers at 0 < t <= ray.t_max; `closest` is left alone if there is none.
    // The ray must be of usable numbers.
    // A shadow ray meets cut-outs as shadows do (shadow_alpha).
    void nearest(const Ray& ray, unsigned layers, std::optional<ClosestHit>& closest,
                 bool shadow = false) const;
    // Whether there is any.
    bool occluded(const Ray& ray, unsigned layers) const;

    // How many of the rays meet a surface of these layers, by Embree alone: nothing is made of what it finds.
    // For measuring what the engine adds to it.
    std::uint64_t count_hits(std::span<const Ray> rays, unsigned layers) const;

    // Memory that Embree holds.
    std::uint64_t bytes() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace lucerna
