// Traces a luminaire, lights among mirrors and glass, to obtain its rays as seen from outside.
//
// Particles start at the luminaire's own lights and are traced until they are absorbed or leave it for good;
// those that leave towards +z, or towards all sides, are the rays of the lamp, as a ray file would hold them.
// They are generated in blocks, so that a thousand million rays need no more memory than one block. Each
// block depends only on the parameters and its index, so that work can stop after any block and continue with
// the next.
//
// The frame of the lamp is the world frame of the scene. Every particle has its own random numbers, so blocks
// are the same for any number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/colour/working_space.h"
#include "engine/scene/scene.h"
#include "lights/lumigraph.h"
#include "lights/ray_set.h"
#include "photon/ledger.h"

namespace lucerna {

struct LuminaireParameters {
    std::int64_t paths = 0;  // light paths, 1 to 2^32
    std::int64_t block = std::int64_t{1}
                         << 20;  // paths per block, >= 1; a power of two keeps blocks stratified
    std::uint64_t seed = 0;
    WorkingSpace colours = {};  // of the scene
    SlabAxes side;              // side to which the rays leave, whose axes give their coordinates
    // Records rays to all sides, which start where they leave the box of the luminaire's surfaces. `side` is
    // ignored.
    bool all_sides = false;

    std::int64_t blocks() const { return (paths + block - 1) / block; }
};

// The balance of a luminaire: the ledger, and the escaped flux by direction. Sums over paths until scaled by
// 1 / paths; then the flux of one lamp, in the unit of its lights.
struct LuminaireFlux {
    Ledger ledger;
    V3d forward{0, 0, 0};   // left towards the chosen side, +z by default: the rays
    V3d backward{0, 0, 0};  // left backwards or sideways

    void add(const LuminaireFlux& other) {
        ledger.add(other.ledger);
        forward += other.forward;
        backward += other.backward;
    }
    void scale(double factor) {
        ledger.scale(factor);
        forward *= factor;
        backward *= factor;
    }
};

struct LuminaireBlock {
    std::vector<LampRay>
        rays;  // metres, in the world's frame; flux is the luminance of the path's power, not yet / paths
    RayTints tints;      // of each ray, or one for all
    LuminaireFlux flux;  // of the paths of this block
    // Absorbed power by the number of the material, in the unit of Ledger::absorbed, whose sum it is. Empty
    // if nothing was absorbed.
    std::vector<V3d> absorbed;
};

// Rays with a smaller d.z count as leaving sideways, since they would cross the plane S at infinity.
inline constexpr float kLeastForward = 1e-6F;

// Throws InputError, with the cause, unless the scene can be traced as a luminaire: lights with a position
// and power, no media, parameters in range.
void check_luminaire(const Scene& scene, const LuminaireParameters& parameters);

// Traces block `index` in [0, parameters.blocks()), for parameters that check_luminaire() accepts. The ranks
// share its paths, and each gets the complete block, or an empty one if Ranks::stopped() then.
LuminaireBlock trace_luminaire(const Scene& scene, const LuminaireParameters& parameters, std::int64_t index,
                               const Workers& workers);

// Returns the luminance of a flux of the balance, which is what a lamp's flux counts.
inline double light_of(const V3d& flux) {
    return double{luminance(Rgb(V3f(flux)))};
}

// Traces all blocks into one set, for luminaires of few rays; the set's flux is that of the lamp, and its
// colours are those of the rays. Throws InputError as check_luminaire() does, if no ray leaves towards the
// chosen sides, and if the rays exceed the memory, and Stopped if the user stops it.
RaySet trace_rays(const Scene& scene, const LuminaireParameters& parameters, FluxUnit unit,
                  const Workers& workers, Monitor& monitor);

// A traced luminaire, with the balance of the flux of one lamp.
struct TracedLuminaire {
    RaySet rays;
    LuminaireFlux flux;
    std::vector<V3d> absorbed;  // by the number of the material; empty if nothing was absorbed
};
// Traces all blocks like trace_rays().
TracedLuminaire trace_whole_luminaire(const Scene& scene, const LuminaireParameters& parameters,
                                      FluxUnit unit, const Workers& workers, Monitor& monitor);

}  // namespace lucerna
