// Guides the sampling of direct light by photons [Goesele 2003, 5.3].
//
// A photon straight from a light tells that light from one part of it has reached the place where the photon
// lies. The nearest photons around a point, counted by part, form a small distribution over (light, part)
// that tells which of them are important there, shadows included. It serves importance sampling only: every
// other choice must keep some probability, for light that sent no photon here. A rough distribution therefore
// suffices. Photons are searched by Euclidean distance, which is cheapest, and those from behind the surface
// do not count. Distributions are cached at the positions of some photons; a point uses the nearest one that
// faces about the same way, which costs a fraction of a search for many photons.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/sampler.h"
#include "engine/scene/scene.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/light_choice.h"
#include "lights/light.h"
#include "photon/photon_map.h"

namespace lucerna {

struct GuideSettings {
    static constexpr int kMostPhotons = 255;

    // A cached distribution has k photons, in [1, kMostPhotons]; 0 caches none, for any_near() alone.
    int k = 64;
    float radius = 1;                   // the largest distance of photons, scene units, > 0
    IndexKind index = IndexKind::tree;  // acceleration structure of the photons and of the distributions
};

// Represents one photon as a sample of the distribution over (light, part).
struct PartSample {
    std::uint32_t light;
    CellId part;
    float weight;  // finite, not negative
    float plain;   // probability of this choice without photons, in [0, 1]
};
// Makes the histogram of the samples by light and part. Takes at most kMostPhotons samples, nearest first;
// other orders change it only by rounding. Appends the guide's choices, none if no sample has weight, and
// returns the recommended share of the plain strategy.
float make_histogram(std::span<const PartSample> samples, std::vector<Guide::Choice>& choices);

// Holds photons straight from the lights, and the distributions made of them. Immutable, safe to share
// between threads.
class GuideMap {
  public:
    // `lights` are the scene's, by which photons number their lights. Photons of lights that only particles
    // carry do not count. `tree` makes the plain choice (null: it is by power). Its suns do not count either,
    // because every point samples all of them.
    GuideMap(PhotonMap map, std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
             const GuideSettings& settings, const Workers& workers);

    // Returns the nearest cached distribution on the side of n (unit), within the radius. It refers to this.
    Guide at(const V3f& x, const V3f& n) const;
    // Tells whether any photon counts within the radius.
    bool any_near(const V3f& x, const V3f& n) const;

    const PhotonMap& map() const { return map_; }
    std::size_t distributions() const { return distributions_.size(); }
    const GuideSettings& settings() const { return settings_; }

  private:
    struct CachedDistribution {
        std::size_t first, size;  // in choices_
        float defensive_weight;
    };
    void cache_distributions(std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
                             const Workers& workers);

    PhotonMap map_;
    GuideSettings settings_;
    std::vector<V3f> places_;  // of the cached distributions; their normals are on the lit side
    std::vector<PackedDirection> normals_;
    std::vector<CachedDistribution> distributions_;
    std::vector<Guide::Choice> choices_;
    std::unique_ptr<PhotonIndex> index_;  // of the distributions' places with their normals; null: none
};

// build_guides() stores the first hits of `paths` light paths, in [1, 2^32], on any surface. They are the
// first paths of maps of the same seed and pass. If the monitor stopped it, the result must not be used.
struct GuideParameters {
    std::int64_t paths = 0;
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    GuideSettings settings;
};
GuideMap build_guides(const Scene& scene, const GuideParameters& parameters, const Workers& workers,
                      Monitor& monitor);

// These functions sample direct light with the help of photons straight from lights [Goesele 2003, 5.2, 5.3].
//
//   gated   samples as `mc`, but only where a photon lies near. Elsewhere it finds no light, which is a bias.
//           With M paths of power Φ/M and a gate of radius r on a flat surface lit by E, the probability that
//           none landed is exp(-π r² E M/Φ), so the mean over maps lacks E times that, which is at most
//           Φ/(e π r² M).
//   guided  samples as `mc`, but a mixture of the photons near and the plain strategy chooses lights and
//           their parts: unbiased.
//
// `guided` evaluates the unoccluded light of several candidates, traces one shadow ray to one of them, chosen
// in proportion to it, and lets it stand for all (resampled importance sampling [Talbot 2005]). Where the
// BSDF's strategy of MIS is expected to find next to nothing, its ray is subject to Russian roulette. In a
// scene with nothing_to_choose() renderers use `mc` in its place, which does the same with less work.

struct GuidedLightSettings {
    static constexpr int kMostCandidates = 1024;
    int candidates = 16;  // per shadow ray, in [1, kMostCandidates]
};

// Returns the number of candidates that pays. Candidates on a measured lamp cost little beside a shadow ray,
// and their light differs much; candidates of whole lights differ less than their shadows do.
int candidates_that_pay(const Scene& scene);

// Both work like direct_light(). `plain` is the choice without photons.
std::optional<BsdfSample> gated_light(const Scene& scene, const GuideMap& guides, const Vertex& vertex,
                                      Sampler& sampler, const LightChoice& plain, const PathAccount& path);

class GuidedLight {
  public:
    // Keeps references to the scene and the guides.
    GuidedLight(const Scene& scene, const GuideMap& guides, const GuidedLightSettings& settings)
        : scene_(scene), guides_(guides), settings_(settings) {}
    std::optional<BsdfSample> operator()(const Vertex& vertex, Sampler& sampler, const LightChoice& plain,
                                         const PathAccount& path) const;

  private:
    const Scene& scene_;
    const GuideMap& guides_;
    GuidedLightSettings settings_;
};

}  // namespace lucerna
