// Runs the importance pre-pass of a render: learns which lights and which of their particles the image needs.
//
// Importons tell where the maps are read; pre-pass light paths, emitted plainly, leave photons there. The
// importance of a path to the image is what its photons add to the variance of the pixels, relative to what
// the pixels show. In an estimate from the k nearest photons, in a disc of radius r, a photon of power Φ
// contributes Φ w / (π r²), where w is the importon's weight. A path's second moment is therefore
//
//   m = Σ over its photons, Σ over the estimates that hold them, (Φ w / (π r²) / (L + ε))²
//
// where L is the pixel's own radiance as the pre-pass's photons show it, and ε is a share of the mean L that
// keeps black pixels from mattering most. The importance of a block of emission numbers is the root of their
// mean m. It is approximate: photons of one path are assumed to land in different pixels, and a pixel's
// gather rays in different places. Where that is wrong, the learned density is less efficient, but still
// unbiased (learned_emission.h).
//
// No pass has the pre-pass's paths and rays, so the learned density does not depend on the photons that it
// weighs. Scenes whose media scatter keep plain emission: the pre-pass does not look at estimates in media.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/scene/render_context.h"
#include "photon/density_estimate.h"
#include "photon/deposit.h"
#include "photon/learned_emission.h"

namespace lucerna {

// Importons tell where the image reads its photon maps.
//
// An importon represents one such look-up: a place, the side that is seen, and how much of the radiance there
// reaches the film. Camera rays pass mirrors, glass and gloss, one way at each, to the first surfaces that
// store photons. With a final gather, one diffuse bounce then leads on to where a gather ray lands.

// Describes camera rays, evenly over the film. Chunks are of fixed size: results do not depend on threads.
struct ViewRays {
    std::int64_t count, per_chunk;
    std::uint64_t seed;
};
// Calls visit(ray, number, sampler, part) for each ray. Each chunk fills a part of its own.
template <typename Part, typename Visit>
std::vector<Part> trace_view_rays(const View& view, const ViewRays& rays, const Workers& workers,
                                  Visit&& visit) {
    std::vector<Part> parts(static_cast<std::size_t>((rays.count + rays.per_chunk - 1) / rays.per_chunk));
    parallel_ranges(
        workers, rays.count, rays.per_chunk, [&](std::int64_t begin, std::int64_t end, std::int64_t chunk) {
            for (auto i = static_cast<std::uint32_t>(begin); i < static_cast<std::uint32_t>(end); ++i) {
                Sampler sampler = Sampler::stratified(rays.seed, Purpose::importance, 0, i);
                const V2f at = sampler.next2(), lens = sampler.next2();
                const V2f film = view.begin + at * (view.end - view.begin);
                visit(view.camera->ray(film, lens), i, sampler, parts[static_cast<std::size_t>(chunk)]);
            }
        });
    return parts;
}

struct Importon {
    V3f p;
    V3f n;              // unit, on the visible side
    float weight;       // factor from the irradiance there to its camera ray's radiance, > 0
    std::uint32_t ray;  // index of the camera ray
    bool at_gather;     // true where a gather ray ends, false where the camera sees it
};

struct ImportonParameters {
    std::int64_t rays = 16384;  // number of camera rays, evenly over the film
    bool gather = false;        // whether gather rays are followed
    bool meter = false;         // the image shows illuminance: the first surface is white
    std::uint64_t seed = 0;
};

// Traces importons, in the order of the rays. The result is the same for any number of threads.
std::vector<Importon> trace_importons(const Scene& scene, const View& view,
                                      const ImportonParameters& parameters, const Workers& workers);

// The pre-pass has this pass number, which no pass has, nor the pre-pass for radii.
inline constexpr std::uint32_t kEmissionPrePass = 0xfffffffeU;

struct ImportancePrePassSettings {
    std::int64_t paths = 0;  // light paths of the pre-pass, in [1, 2^24]
    std::uint64_t seed = 0;
    // These tell which maps the image reads where the camera looks, and where gather rays (if any) land.
    std::array<bool, kMapKinds> seen{}, at_gather{};
    bool gather = false;
    bool meter = false;                 // the image shows illuminance
    DensityEstimateSettings estimate;   // k: pre-pass photons in an estimate
    float specular_below = 0;           // see MapParameters
    IndexKind index = IndexKind::tree;  // see MapParameters
};

struct ImportancePrePass {
    LearnedEmission emission;
    std::size_t importons = 0;
    double useful = 0;  // share of the pre-pass's paths of which an estimate holds a photon
    double seconds = 0;
};

// Paths 0, 1 … of Emission(scene, seed, Purpose::emission, pass, emission), of which a density is learned.
struct PilotPaths {
    std::uint32_t pass = kEmissionPrePass;
    std::int64_t count = 0;
    std::shared_ptr<const LearnedEmission> emission = nullptr;  // null: plain
};
struct LearnedDensity {
    LearnedEmission emission;
    double effective = 0;  // how many paths of equal second moments would tell as much
};
// Learns the density from the second moment of each path of all pilots, in their order. Paths of different
// densities are weighted as if all were drawn from their mixture [Veach 1997, 9.2].
LearnedDensity learn_density(const Scene& scene, std::uint64_t seed, std::span<const PilotPaths> pilots,
                             std::span<const float> moments);

// Describes a pre-pass of so many light paths in words.
std::string describe_pre_pass(std::int64_t paths);

// Returns why light paths are emitted by power alone, or an empty text if a pre-pass of `paths` light paths
// may guide them.
std::string_view why_emission_is_plain(std::int64_t paths, const RenderContext& context);

// Runs the pre-pass. Returns none if there is nothing to learn (no light, nothing seen, a medium that
// scatters), or if the monitor stopped it. The result is the same for any number of threads.
std::optional<ImportancePrePass> run_importance_pre_pass(const Scene& scene, const View& view,
                                                         const ImportancePrePassSettings& settings,
                                                         const Workers& workers, Monitor& monitor);

// LearnedEmission is learned from second moments of pre-pass paths, as blocks of emission numbers.
//
// A trial is one light path: its emission numbers, and the second moment of what it would bring to the image
// if it had been drawn plainly. Trials of other densities count by their weight. Drawn from density q instead
// of p, paths have the variance ∫ m p²/q - (mean)², where m is the mean second moment at given numbers. Over
// all q that is least for q ∝ p sqrt(m). The importance of a block is therefore the root of the mean of its
// trials' second moments, and cutting a block gains as much as the mean of its pieces' roots lies below the
// root of its own mean.
//
// Blocks are halved, the one that gains most first, as long as its trials show beyond chance that its pieces
// differ: a chi-square test compares eight slices along an axis, so that chance alone cuts about one block in
// a thousand. Two slices would not do: what the image needs of a lamp often lies in its middle, where both
// halves are equally important.

struct EmissionTrial {
    LeSampleU u;
    float score = 0;   // second moment, in any unit; finite, not negative; 0: no contribution
    float weight = 1;  // plain density over that of the trial, > 0
};

struct BlockSettings {
    std::size_t most_cuts = 4096;   // over all lights
    std::size_t least_trials = 32;  // in a block that may be cut
};

// Learns the blocks of each light. `trials[i]` are those of light i, in any order; they are reordered.
// `powers` are the lights', by which the trials were drawn. A light without trials is as important as all are
// on average. The result depends on the trials alone.
std::vector<EmissionBlocks> learn_blocks(std::span<std::vector<EmissionTrial>> trials,
                                         std::span<const double> powers, const BlockSettings& settings);

}  // namespace lucerna
