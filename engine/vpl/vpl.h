// Virtual point lights (VPLs) of instant global illumination: the light paths of photon mapping, each hit
// stored as a point light [Keller 1997; Pharr 2004].
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "photon/bounce.h"
#include "photon/light_path.h"
#include "photon/photon_map.h"

namespace lucerna {

// A virtual point light: on a surface a Lambertian one, in a medium what its phase function makes of one
// particle.
struct Vpl {
    SurfacePoint at;  // n on the side that shines; 0 in a medium
    Rgb contribution;  // for one path: α ρ_hd / π, W/sr towards the normal; in a medium the power scattered,
                       // W
    bool in_medium = false;
    float g = 0;              // in a medium: of its phase function
    V3f d{0, 0, 0};           // in a medium: the direction of travel of what it scattered
    BounceCount bounces = 0;  // of its path before it
    std::uint32_t light = 0;  // of a scene with light groups: index of the light that its path came from

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
    int longest = kMaxBounces;  // bounces of a light path before a VPL, at the most; negative: no VPLs
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

// What a hit makes of a light path: VPLs, if it scatters light that a shadow ray could bring [Pharr 2004].
//
// A VPL stands for what a surface makes of one arriving particle by its lobes that are no deltas. Of power Φ
// from direction i and a Lambertian part of albedo ρ it sends Φ ρ/π cosθ per solid angle, which is exact; for
// other lobes ρ is the albedo for i, and the shape is lost. What lets light through shines on both sides,
// each with its own albedo. Delta lobes make no VPL: their light goes on with the path, and is a VPL where it
// meets the next surface.

// Calls visit(Vpl) for each side of the surface that shines.
template <typename Visit>
void make_vpls(const LightPathHit& at, VplGloss gloss, Visit&& visit) {
    // Mirrors and smooth glass scatter no light that a shadow ray could bring.
    if (at.bsdf.is_delta() || at.bsdf.is_black()) return;
    // Bent normals: what arrives from below their horizon is absorbed, as it is on the path's way on; and a
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
