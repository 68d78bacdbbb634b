// The importance pre-pass of a render: which lights, and which of their particles, the picture needs.
//
// Importons say where the maps are read; pre-pass light paths, emitted plainly, leave photons
// there. The importance of a path to the picture is what its photons add to the variance of the pixels,
// relative to what the pixels show. An estimate from the k nearest photons, of which one has power Φ and the
// disc the radius r, holds Φ w / (π r²) of it, w the importon's weight; so a path's second moment is
//
//   m = Σ over its photons, Σ over the estimates that hold them, (Φ w / (π r²) / (L + ε))²
//
// with L the pixel's own radiance as the pre-pass's photons show it, and ε a share of the mean L that keeps
// black pixels from mattering most. The importance of a block of emission numbers is then the root of their
// mean m. That is importance and nothing more: photons of one path are taken to land in
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

// Where the picture reads its photon maps: camera rays, followed to the surfaces on which photons lie.
//
// An importon stands for one such look: a place, the side that is looked at, and how much of the radiance
// there reaches the film. Camera rays pass mirrors, glass and gloss, one way at each, to the first surfaces
// that store photons; where indirect light is by final gather, one diffuse bounce leads on to where a gather
// ray lands.

// Camera rays, evenly over the film. Chunks are of a fixed size, so that results do not depend on threads.
struct ViewRays {
    std::int64_t count, per_chunk;
    std::uint64_t seed;
};
// Calls look(ray, number, sampler, part) for each: a chunk fills a part of its own.
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
    V3f n;              // unit, on the side that is looked at
    float weight;       // of the irradiance there in its ray's radiance, > 0
    std::uint32_t ray;  // the camera ray
    bool at_gather;     // where a gather ray ends; else the camera sees it
};

struct ImportonParameters {
    std::int64_t rays = 16384;  // camera rays, evenly over the film
    bool gather = false;        // whether gather rays are followed
    bool meter = false;         // the image shows illuminance: the first surface is a white one
    std::uint64_t seed = 0;
};

// In the order of the rays; the same for any number of threads.
std::vector<Importon> trace_importons(const Scene& scene, const View& view,
                                      const ImportonParameters& parameters, const Workers& workers);

// A pre-pass's place among the passes: none of them ever has that number, nor has the pre-pass for radii.
inline constexpr std::uint32_t kEmissionPrePass = 0xfffffffeU;

struct ImportancePrePassSettings {
    std::int64_t paths = 0;  // light paths of the pre-pass, in [1, 2^24]
    std::uint64_t seed = 0;
    // Which maps the image reads where the camera looks, and where gather rays land (if it gathers).
    std::array<bool, kMapKinds> seen{}, at_gather{};
    bool gather = false;
    bool meter = false;                 // the image shows illuminance
    DensityEstimateSettings estimate;   // k: photons of the pre-pass in an estimate
    float specular_below = 0;           // MapParameters'
    IndexKind index = IndexKind::tree;  // MapParameters'
};

struct ImportancePrePass {
    LearnedEmission emission;
    std::size_t importons = 0;
    double useful = 0;  // share of the pre-pass's paths that an estimate held a photon of
    double seconds = 0;
};

// The density learned from pre-pass paths 0, 1 …, each by its second moment. They must have started plainly:
// from Emission(scene, seed, Purpose::emission, kEmissionPrePass).
LearnedEmission learn_density(const Scene& scene, std::uint64_t seed, std::span<const float> scores);

// A pre-pass of so many light paths, in words.
std::string describe_pre_pass(std::int64_t paths);

// Returns why light paths are emitted by power alone, or an empty text if a pre-pass of `paths` light paths
// may guide them.
std::string_view why_emission_is_plain(std::int64_t paths, const RenderContext& context);

// None where there is nothing to learn: no light, nothing seen, a medium that scatters; or if the monitor
// stopped it. The same for any number of threads.
std::optional<ImportancePrePass> run_importance_pre_pass(const Scene& scene, const View& view,
                                                         const ImportancePrePassSettings& settings,
                                                         const Workers& workers, Monitor& monitor);

// From the second moments of pre-pass paths to blocks of emission numbers: how LearnedEmission is learned.
//
// A trial is one light path drawn plainly: the numbers it began with and the second moment of what it brought
// to the picture. Drawn from density q instead of p, paths have the
// variance ∫ m p²/q - (mean)², m the mean second moment at given numbers; over all q that is least for q ∝ p
// sqrt(m). So the importance of a block is the root of the mean of its trials' second moments, and cutting a
// block pays by as much as the mean of its parts' roots lies below the root of their mean.
//
// Blocks are cut in half, the one that pays most first, as long as its trials show beyond chance that its
// parts differ: eight slices along an axis are compared by a chi-square test, so that chance alone cuts about
// one block in a thousand. Eight and not two: what the picture needs of a lamp often lies in its middle,
// where both halves are equally important.

struct EmissionTrial {
    LeSampleU u;
    float score = 0;  // second moment, in any unit; finite, not negative; 0: it brought nothing
};

struct BlockSettings {
    std::size_t most_cuts = 4096;   // of all lights' blocks
    std::size_t least_trials = 32;  // in a block that is cut
};

// `trials[i]`: those of light i, in any order; they are moved about. `powers`: of the lights, by which they
// were drawn; a light without trials is as important as all are on the average. The same for the same trials.
std::vector<EmissionBlocks> learn_blocks(std::span<std::vector<EmissionTrial>> trials,
                                         std::span<const double> powers, const BlockSettings& settings);

}  // namespace lucerna
