// A luminaire that the engine traces itself: lights among mirrors and glass, seen from outside.
//
// Particles start at the luminaire's own lights and are traced until they are absorbed or leave it for good;
// those that leave towards +z are rays of the lamp, as a ray file would hold them. They come in blocks, so
// that a thousand million of them need no more memory than one block, and each block is a function of the
// parameters and its number alone: work can be stopped after any block and taken up again with the next.
//
// The lamp's frame is the scene's world. Every particle has its own numbers, so that blocks are the same on
// any number of threads.
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
    SlabAxes side;              // the rays are those that leave to this side, told along its axes

    std::int64_t blocks() const { return (paths + block - 1) / block; }
};

// Where the light went: the ledger, and what escaped told apart. Sums over paths until scaled by 1 / paths,
// then the flux of one lamp, in the unit of its lights.
struct LuminaireFlux {
    Ledger ledger;
    V3d forward{0, 0, 0};   // left to the side, +z by itself: the rays
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
    RayTints tints;      // of each ray, or of all
    LuminaireFlux flux;  // of these paths
};

// Rays with a smaller d.z leave sideways: they would pass S at infinity.
inline constexpr float kLeastForward = 1e-6F;

// Throws InputError, with the cause, unless the scene can be traced as a luminaire: lights that have a place
// and power, no media, parameters in range.
void check_luminaire(const Scene& scene, const LuminaireParameters& parameters);

// Block number `index` in [0, parameters.blocks()) of parameters that check_luminaire() accepts. Ranks share
// out its paths, and each has the whole block; none of it where Ranks::stopped() then.
LuminaireBlock trace_luminaire(const Scene& scene, const LuminaireParameters& parameters, std::int64_t index,
                               const Workers& workers);

// All blocks in one set, for luminaires of few rays: their flux is the lamp's, and colours those of the rays.
// Throws InputError as check_luminaire() does, when no ray leaves, and when the user stops it.
RaySet trace_rays(const Scene& scene, const LuminaireParameters& parameters, FluxUnit unit,
                  const Workers& workers, Monitor& monitor);

}  // namespace lucerna
