// Importance for direct light from photons [Goesele 2003, 5.3].
//
// A photon of the Direct map says that light from its part of its light has reached the place where it rests.
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
#include "engine/scene/scene.h"
#include "lights/light.h"
#include "photon/photon_map.h"

namespace lucerna {

struct GuideSettings {
    static constexpr int kMostPhotons = 255;

    int k =
        64;  // photons of a cached distribution, in [1, kMostPhotons]; 0: none is cached, any_near() alone
    float radius = 1;  // the largest distance at which they are looked for, scene units, > 0
};

// The distribution over lights and their parts at one point. Refers to choices that are kept elsewhere.
class Guide {
  public:
    struct Choice {
        std::uint32_t light;
        CellId part;  // kNoCell: the light has no parts
        float probability;
        float upto;  // its own and that of all before it
    };
    Guide() = default;
    // As make_histogram() gave them.
    Guide(std::span<const Choice> choices, float defensive_weight)
        : choices_(choices), defensive_weight_(defensive_weight) {}

    // Nothing to go by: no photon near, or none of any weight. draw() must not be asked then.
    bool empty() const { return choices_.empty(); }
    // In the order of lights and parts, each once; the probabilities add up to 1.
    std::span<const Choice> choices() const { return choices_; }
    // u in [0,1); a choice of probability 0 is never drawn.
    const Choice& draw(float u) const;
    // 0 for what the photons do not name.
    float probability(std::uint32_t light, CellId part) const;

    // How much of a mixture the plain choice should be, in [0, 1]: what makes the photons here most likely,
    // each judged by the others (leave-one-out). Near 1 where they are scattered as the plain choice would
    // scatter them, or too few to tell; near 0 where they agree. 1 if there are none.
    float defensive_weight() const { return defensive_weight_; }

  private:
    std::span<const Choice> choices_;
    float defensive_weight_ = 1;
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
    // particles carry are no samples.
    GuideMap(PhotonMap map, std::span<const std::unique_ptr<Light>> lights, const GuideSettings& settings,
             const Workers& workers);

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
    void cache_distributions(std::span<const std::unique_ptr<Light>> lights, const Workers& workers);

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

}  // namespace lucerna
