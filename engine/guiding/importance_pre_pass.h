// The importance pre-pass of a render: which lights, and which of their particles, the picture needs.
//
// Importons (importons.h) say where the maps are read; pre-pass light paths, emitted plainly, leave photons
// there. The importance of a path to the picture is what its photons add to the variance of the pixels,
// relative to what the pixels show. An estimate from the k nearest photons, of which one has power Φ and the
// disc the radius r, holds Φ w / (π r²) of it, w the importon's weight; so a path's second moment is
//
//   m = Σ over its photons, Σ over the estimates that hold them, (Φ w / (π r²) / (L + ε))²
//
// with L the pixel's own radiance as the pre-pass's photons show it, and ε a share of the mean L that keeps
// black pixels from mattering most. The importance of a block of emission numbers is then the root of their
// mean m (emission_blocks.h). That is importance and nothing more: photons of one path are taken to land in
// different pixels, and a pixel's gather rays in different places; where that is wrong the learned density is
// less good, and still unbiased (learned_emission.h).
//
// The pre-pass's paths and rays are those of no pass, so the learned density does not depend on the photons
// it weighs. Scenes whose media scatter are left plain: what photons in space are read by is not looked at
// here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/guiding/importons.h"
#include "photon/density_estimate.h"
#include "photon/deposit.h"
#include "photon/learned_emission.h"

namespace lucerna {

// A pre-pass's place among the passes: none of them ever has that number, nor has the pre-pass for radii.
inline constexpr std::uint32_t kEmissionPrePass = 0xfffffffeU;

struct ImportancePrePassSettings {
    std::int64_t paths = 65536;      // light paths, in [1, 2^24]
    float defensive_weight = 0.25F;  // defensive mixture weight: the least share of plain emission, in (0, 1]
    std::uint64_t seed = 0;
    // Which maps the image reads where the camera looks, and where gather rays land (if it gathers).
    std::array<bool, kMapKinds> seen{}, landed{};
    bool gather = false;
    bool meter = false;                // the image shows illuminance
    DensityEstimateSettings estimate;  // k: photons of the pre-pass in an estimate
    float specular_below = 0;          // MapParameters'
};

struct ImportancePrePass {
    LearnedEmission emission;
    std::size_t importons = 0;
    double useful = 0;  // share of the pre-pass's paths that an estimate held a photon of
    double seconds = 0;
};

// The density learned from pre-pass paths 0, 1 …, each by its second moment. They must have started plainly:
// from Emission(scene, seed, Purpose::emission, kEmissionPrePass). `defensive_weight` in (0, 1].
LearnedEmission learn_density(const Scene& scene, std::uint64_t seed, std::span<const float> scores,
                              float defensive_weight);

// None where there is nothing to learn: no light, nothing seen, a medium that scatters; or if the monitor
// stopped it. The same for any number of threads.
std::optional<ImportancePrePass> run_importance_pre_pass(const Scene& scene, const View& view,
                                                         const ImportancePrePassSettings& settings,
                                                         const Workers& workers, Monitor& monitor);

}  // namespace lucerna
