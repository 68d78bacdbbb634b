// What a hit makes of a light path: VPLs, if it scatters light that a shadow ray could bring [Pharr 2004].
//
// A VPL stands for what a surface makes of one arriving particle by its lobes that are no deltas. Of power Φ
// from direction i and a Lambertian part of albedo ρ it sends Φ ρ/π cosθ per solid angle, which is exact; for
// other lobes ρ is the albedo for i, and the shape is lost. What lets light through shines on both sides,
// each with its own albedo. Delta lobes make no VPL: their light goes on with the path, and is a VPL where it
// meets the next surface.
#pragma once

#include "engine/vpl/vpl.h"
#include "photon/shading_normals.h"

namespace lucerna {

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

    const bool with_gloss = gloss == VplGloss::all || (gloss == VplGloss::of_indirect && at.path.diffuse > 0);
    const Bsdf::SidedAlbedo albedo =
        with_gloss ? at.bsdf.blurred_albedo(-at.d) : at.bsdf.blurred_part(INFINITY).blurred_albedo(-at.d);
    SurfacePoint lit = at.hit.at;
    if (lit.n.dot(at.d) > 0) lit.n = -lit.n;
    const auto shine = [&](const Rgb& contribution) {
        if (!is_black(contribution)) visit(Vpl{.at = lit, .contribution = contribution});
    };
    shine(arriving * albedo.reflected);
    lit.n = -lit.n;
    shine(arriving * albedo.transmitted);
}

}  // namespace lucerna
