// Virtual lights of instant global illumination: the photon walk with another end [igi 1, 2].
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/walk.h"

namespace lucerna {

// A Lambertian point of light on a surface.
struct VirtualLight {
    SurfacePoint at;   // n on the side that shines
    Rgb contribution;  // α ρ_hd / π, W/sr towards the normal, for one path
};

struct VirtualLightPlan {
    std::uint32_t sets = 1;   // a power of 2
    std::uint32_t paths = 1;  // light paths per set, a power of 2
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
};

// Independent sets of virtual lights; each set and all sets together start from a well-distributed sequence.
struct VirtualLightSets {
    std::vector<VirtualLight> lights;   // all sets, one after the other
    std::vector<std::uint32_t> begins;  // set s is lights[begins[s]] … lights[begins[s + 1] - 1]
    Ledger ledger;                      // divided by the number of paths
};

VirtualLightSets build_virtual_lights(const Scene& scene, const VirtualLightPlan& plan,
                                      const Workers& workers, Monitor& monitor);

}  // namespace lucerna
