// Makes the virtual point lights (VPLs) of instant global illumination: traces light paths as photon mapping
// does, and stores each hit as a point light [Keller 1997; Pharr 2004].
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/bounce.h"
#include "photon/light_path.h"
#include "photon/photon_map.h"

namespace lucerna {

// Represents a virtual point light. On a surface it is Lambertian; in a medium it sends out what the phase
// function makes of one particle.
struct Vpl {
    SurfacePoint at;  // n on the side that shines; 0 in a medium
    Rgb contribution;  // of one path: α ρ_hd / π, W/sr towards the normal; in a medium the scattered power, W
    bool in_medium = false;
    float g = 0;              // in a medium: of its phase function
    V3f d{0, 0, 0};           // in a medium: the direction of travel before scattering
    BounceCount bounces = 0;  // of its light path before the VPL
    std::uint32_t light = 0;  // index of the light that its path came from, in scenes with light groups

    // Returns the factor from `contribution` to the intensity, W/sr, towards w (unit).
    float towards(const V3f& w) const {
        return in_medium ? HenyeyGreenstein(g).at_cosine(d.dot(w)) : std::max(0.0F, at.n.dot(w));
    }
};

// Says for which light VPLs replace gloss (lobes with a peak, no deltas) by a Lambertian lobe of its albedo.
enum class VplGloss : std::uint8_t {
    all,          // for all light
    of_indirect,  // for light that a surface or medium has scattered, not for light that comes from lamps
                  // directly or over mirrors and other gloss, which photons bring
    none,         // for no light: rays find what comes by way of gloss
};

struct VplParameters {
    std::uint32_t sets = 1;   // a power of 2
    std::uint32_t paths = 1;  // light paths per set, a power of 2
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    const LearnedEmission* emission = nullptr;  // distribution of all path starts; null: by power
    VplGloss gloss = VplGloss::all;
    int longest = kMaxBounces;  // bounces of a light path before a VPL, at the most; negative: no VPLs
};

// Holds independent sets of VPLs. Each set, and all sets together, start from a well-distributed sequence.
struct VplSets {
    std::vector<Vpl> lights;            // set after set
    std::vector<std::uint32_t> begins;  // set s is lights[begins[s]] … lights[begins[s + 1] - 1]
    Ledger ledger;                      // divided by the number of paths
};

// Returns LightPathRequest::specular_below for VPLs. With of_indirect all gloss counts as specular, so that
// light from gloss does not count as scattered.
inline float vpl_specular_below(VplGloss gloss) {
    return gloss == VplGloss::of_indirect ? INFINITY : 0;
}

VplSets build_vpls(const Scene& scene, const VplParameters& parameters, const Workers& workers,
                   Monitor& monitor);

// Makes the VPLs of a light path's hit, if it scatters light that a shadow ray could bring [Pharr 2004].
// Calls visit(Vpl) for each side of the surface that shines.
//
// A VPL stands for the light that the lobes of a surface, except for deltas, scatter from one arriving
// particle. Given power Φ from direction i, a Lambertian part of albedo ρ sends Φ ρ/π cosθ per solid angle,
// which is exact; for other lobes ρ is the albedo for i, and the shape is lost. A surface that transmits
// light shines on both sides, each with its own albedo. Delta lobes make no VPL: their light continues along
// the path, and makes a VPL at the next surface.
template <typename Visit>
void make_vpls(const LightPathHit& at, VplGloss gloss, Visit&& visit) {
    // Mirrors and smooth glass scatter no light that a shadow ray could bring.
    if (at.bsdf.is_delta() || at.bsdf.is_black()) return;
    // Where normals are bent, light from below their horizon is absorbed, as on the path's continuation. A
    // path lands in proportion to the geometric cosine, but is reflected in proportion to the bent one.
    const float side = std::copysign(1.0F, at.bsdf.geometric_normal().dot(-at.d));
    if (!(side * at.bsdf.shading_normal().dot(-at.d) > 0)) return;
    const Rgb arriving = at.power * (shading_cosine_ratio(at.bsdf, -at.d) * kInvPi);

    const bool with_gloss =
        gloss == VplGloss::all || (gloss == VplGloss::of_indirect && at.path.non_specular > 0);
    const Bsdf::SidedAlbedo albedo =
        with_gloss ? at.bsdf.blurred_albedo(-at.d) : at.bsdf.blurred_part(INFINITY).blurred_albedo(-at.d);
    SurfacePoint lit = at.hit.at.facing(-at.d);
    const auto shine = [&](const Rgb& contribution) {
        if (is_black(contribution)) return;
        visit(Vpl{.at = lit, .contribution = contribution, .bounces = kept_bounces(at.path.bounces())});
    };
    shine(arriving * albedo.reflected);
    lit.n = -lit.n;
    shine(arriving * albedo.transmitted);
}

}  // namespace lucerna
