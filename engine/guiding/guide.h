// Importance for direct light from photons [Goesele 2003, 5.3].
//
// A photon straight from a light says that light from that part of it has reached the place where it lies.
// The nearest ones around a point, counted by part, are a small distribution over (light, part): which ones
// are important there, shadows included. It is importance and nothing more: whoever samples by it must leave
// every other choice a chance, for light that sent no photon here. So photons are looked for by plain
// distance, which is the cheapest; those that came from behind the surface do not count; and they are counted
// beforehand, and the distributions cached at some of the photons' own places: a point takes the nearest one
// that faces about the same way, which costs a fraction of a search for many.
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

    // Photons of a cached distribution, in [1, kMostPhotons]; 0: none is cached, any_near() alone.
    int k = 64;
    float radius = 1;                   // the largest distance at which they are looked for, scene units, > 0
    IndexKind index = IndexKind::tree;  // search structure of the photons and of the distributions
};

// One photon as a sample of the distribution over (light, part).
struct PartSample {
    std::uint32_t light;
    CellId part;
    float weight;  // finite, not negative
    float plain;   // the probability with which the choice would be made without photons, in [0, 1]
};
// The histogram of the samples by light and part. At most kMostPhotons samples, nearest first: the same
// distribution in whatever order, up to rounding. Appends the guide's choices, none if no sample has weight,
// and returns its plain share.
float make_histogram(std::span<const PartSample> samples, std::vector<Guide::Choice>& choices);

// Photons straight from the lights and the distributions made of them. Constant, safe to share between
// threads.
class GuideMap {
  public:
    // `lights` are the scene's, by which the photons' lights are numbered. Photons of lights that only
    // particles carry are no samples. `tree`: by which the plain choice is made, and whose suns are no
    // samples either, as all of them are asked; null: by power.
    GuideMap(PhotonMap map, std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
             const GuideSettings& settings, const Workers& workers);

    // On the side of n (unit): the nearest cached distribution within the radius. Lives as long as this.
    Guide at(const V3f& x, const V3f& n) const;
    // Whether any photon counts within the radius.
    bool any_near(const V3f& x, const V3f& n) const;

    const PhotonMap& map() const { return map_; }
    std::size_t distributions() const { return distributions_.size(); }
    const GuideSettings& settings() const { return settings_; }

  private:
    struct CachedDistribution {
        std::size_t first, size;  // among the choices
        float defensive_weight;
    };
    void cache_distributions(std::span<const std::unique_ptr<Light>> lights, const LightTree* tree,
                             const Workers& workers);

    PhotonMap map_;
    GuideSettings settings_;
    std::vector<V3f> places_;  // of the cached distributions, and the normals on the side that is lit
    std::vector<PackedDirection> normals_;
    std::vector<CachedDistribution> distributions_;
    std::vector<Guide::Choice> choices_;
    std::unique_ptr<PhotonIndex> index_;  // of their places by their normals; null: none
};

// From the first impacts of `paths` light paths, in [1, 2^32], on whatever surface. They are the first that
// maps of the same seed and pass are built from. Stopped early (monitor), it must not be used.
struct GuideParameters {
    std::int64_t paths = 0;
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
    GuideSettings settings;
};
GuideMap build_guides(const Scene& scene, const GuideParameters& parameters, const Workers& workers,
                      Monitor& monitor);

// Direct light with the help of photons that came straight from the lights [Goesele 2003, 5.2, 5.3].
//
//   gated   as `mc`, but only where a photon lies near. Where none landed there is no light: too dark by what
//           arrives there. With M paths of power Φ/M and a gate of radius r on a flat surface lit by E, the
//           chance that none landed is exp(-π r² E M/Φ), so the mean over maps lacks E times that; no
//           irradiance lacks more than Φ/(e π r² M).
//   guided  as `mc`, but lights and their parts are chosen by the photons near, mixed with the plain choice:
//           unbiased.
//
// `guided` asks several places of lights for what would arrive, traces one shadow ray to one of them chosen
// in proportion to that, and lets it stand for all (resampled importance sampling [Talbot 2005]). Where the
// BSDF's strategy of MIS is expected to find next to nothing, its ray is traced only sometimes and weighs
// more. In a scene with nothing_to_choose() renderers take `mc` in its place: it does the same with less
// work.

struct GuidedLightSettings {
    static constexpr int kMostCandidates = 1024;
    int candidates = 16;  // places of lights weighed before one is asked for, in [1, kMostCandidates]
};

// As many candidates as pay. Those of a measured lamp's places cost little beside a shadow ray, and what
// arrives differs much between them; those of whole lights differ less than their shadows do.
int candidates_that_pay(const Scene& scene);

// Both as direct_light(); `plain` is the choice without photons.
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
