// Virtual point lights (VPLs) of instant global illumination: the light paths of photon mapping, each hit
// stored as a point light [Keller 1997; Pharr 2004].
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/light_path.h"

namespace lucerna {

// A virtual point light: on a surface a Lambertian one, in a medium what its phase function makes of one
// particle.
struct Vpl {
    SurfacePoint at;  // n on the side that shines; 0 in a medium
    Rgb contribution;  // for one path: α ρ_hd / π, W/sr towards the normal; in a medium the power scattered,
                       // W
    bool in_medium = false;
    float g = 0;     // in a medium: of its phase function
    V3f d{0, 0, 0};  // in a medium: the direction of travel of what it scattered

    // The share of `contribution` that leaves towards w (unit): W/sr per W of it.
    float towards(const V3f& w) const {
        return in_medium ? HenyeyGreenstein(g).at_cosine(d.dot(w)) : std::max(0.0F, at.n.dot(w));
    }
};

// Of which light VPLs take gloss (lobes with a peak that are no deltas) for a Lambertian part of its albedo.
enum class VplGloss : std::uint8_t {
    all,          // of all
    of_indirect,  // of what some surface or medium has scattered; not of what lamps send, straight or over
                  // mirrors and other gloss: photons bring what becomes of that
    none,         // of none: rays find what comes by way of gloss
};

struct VplParameters {
    std::uint32_t sets = 1;   // a power of 2
    std::uint32_t paths = 1;  // light paths per set, a power of 2
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    const LearnedEmission* emission = nullptr;  // by which all paths start; null: plainly, by power
    VplGloss gloss = VplGloss::all;
};

// Independent sets of VPLs; each set and all sets together start from a well-distributed sequence.
struct VplSets {
    std::vector<Vpl> lights;            // all sets, one after the other
    std::vector<std::uint32_t> begins;  // set s is lights[begins[s]] … lights[begins[s + 1] - 1]
    Ledger ledger;                      // divided by the number of paths
};

// LightPaths::specular_below for VPLs: where it matters what has been scattered before, gloss does not count
// as that.
inline float vpl_specular_below(VplGloss gloss) {
    return gloss == VplGloss::of_indirect ? INFINITY : 0;
}

VplSets build_vpls(const Scene& scene, const VplParameters& parameters, const Workers& workers,
                   Monitor& monitor);

}  // namespace lucerna
