// How many slabs a ray set needs, where they go, and what each of them holds.
#pragma once

#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "lights/lumigraph.h"
#include "lights/measurement/ray_projection.h"
#include "lights/ray_set.h"

namespace lucerna {

struct LumigraphOptions {
    FitOptions fit;  // of each slab; `z` with one slab alone
    int slabs = 0;   // 1 (+z), 2 (+z, -z) or 6; 0: as few as hold kHeld of the usable flux
};

struct LumigraphFit {
    Lumigraph lamp;
    // Of the whole set. `backward`: rays towards sides that have no slab.
    FluxAccount account;
    std::vector<FluxAccount> slabs;  // of each: of its share of the rays' light
};

// A slab whose share of the flux is no more than this is left out: its light goes to its neighbours.
inline constexpr double kNegligible = 1e-3;
// What one slab, or two, must hold of the usable flux to be enough.
inline constexpr double kHeld = 0.99;

// One slab is that of fit_light_field(). Otherwise each ray is shared out among the slabs by its direction
// (SlabShares), and each slab gets the planes that suit its share, with S at its waist. The lamp's box is
// the least that both nearly all rays' starts and nearly all lines' points nearest to their common middle lie
// in: rays may start on a surface far around the lamp. Throws InputError as fit_light_field().
LumigraphFit fit_lumigraph(const RaySet& rays, const LumigraphOptions& options, const Workers& workers,
                           Monitor& monitor);

// The box that the light of a ray set begins in, in the frame of the rays.
Box3d box_of(const RaySet& rays);

}  // namespace lucerna
