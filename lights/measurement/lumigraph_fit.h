// Chooses how many slabs a ray set needs, where they go, and what each of them holds.
#pragma once

#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"

namespace lucerna {

struct LumigraphOptions {
    FitOptions fit;               // of each slab; `z` only with a single slab
    int slabs = 0;                // 1 (+z), 2 (+z, -z) or 6; 0: the fewest that hold kHeld of the usable flux
    std::vector<SlabAxes> sides;  // if given, the sides that get a slab, all different, instead of `slabs`
};

struct LumigraphFit {
    Lumigraph lamp;
    // The account of the whole set; `backward` is that of rays towards sides without a slab.
    FluxAccount account;
    std::vector<FluxAccount> slabs;  // of each slab's share of the rays' light
};

// A slab with no more than this share of the flux is left out, and its light goes to its neighbours.
inline constexpr double kNegligible = 1e-3;
// The share of the usable flux that one or two slabs must hold to suffice.
inline constexpr double kHeld = 0.99;

// A single slab is fitted by fit_light_field(). Otherwise each ray is shared among the slabs by its direction
// (SlabShares), and each slab gets the planes that suit its share, with S at its waist. The lamp's box is the
// smallest that contains both nearly all rays' starts and nearly all lines' points nearest to their common
// centre, because rays may start on a surface far around the lamp. Throws InputError as fit_light_field().
LumigraphFit fit_lumigraph(const RaySet& rays, const LumigraphOptions& options, const Workers& workers,
                           Monitor& monitor);

// Returns the box in which the light of a ray set begins, in the frame of the rays.
Box3d box_of(const RaySet& rays);

}  // namespace lucerna
