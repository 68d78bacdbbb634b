// Samples small lamps over mirrors and smooth glass, where photons tell how.
//
// No light sample reaches a lamp behind glass, and a ray that is drawn without regard to the lamp seldom
// meets a small one. Photons that went over perfectly specular surfaces know such ways: at a place, each of
// the nearest photons names a sequence of events and a direction, from which Newton's method finds the chain
// to a point drawn on the lamp [specular manifold sampling: Zeltner et al. 2020].
//
// Which chains are found is a function of the place and the point on the lamp alone, since photons and order
// are fixed. Rays drawn by the BSDF that meet the lamp over such a chain are weighted against the search by
// multiple importance sampling, and all other ones count in full. The estimate is therefore unbiased, however
// few chains the photons know, except for light of point lamps, which only the search can find.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/scene.h"
#include "engine/transport/direct_light.h"
#include "engine/transport/specular_chain.h"
#include "photon/photon_map.h"

namespace lucerna {

class ChainGuide final : public ChainSearch {
  public:
    // Holds the end of a photon's chain.
    struct Seed {
        V3f via;    // the last specular surface, as light travels
        V3f first;  // the first one
        std::uint32_t light;
        ChainEvents events;  // from the photon to the lamp
    };
    // `photons` name their seeds by their cells.
    ChainGuide(const Scene& scene, const Photons& photons, std::vector<Seed> seeds, std::int64_t paths,
               const Workers& workers);

    // Describes a place from which lamps are searched for.
    struct Place {
        const Vertex& at;
        const DirectionDensity& drawn_by;  // the density of the other strategy's directions
        float chance;                      // probability of the search, in (0,1]
        int bounces_left;                  // of the path, the one at the place included
    };
    // Samples the lamps over the chains near the place, and books the radiance that they send towards wo on
    // the path that ends there.
    void add_light(const Place& place, Sampler sampler, const PathAccount& path) const;
    // Returns what a path must remember that leaves the place in a direction drawn with density `pdf_w`.
    ChanceChain chance_chain(const Place& place, const V3f& first, float pdf_w) const;

    float share(const ChanceChain& chain, std::uint32_t light, const ChainEnd& end) const override;

    // Returns the number of light paths that were traced.
    std::int64_t paths() const { return paths_; }

    // Holds the largest number of photons that are asked at one place.
    static constexpr int kMostGuesses = 128;

  private:
    struct Guesses {
        std::array<const Seed*, kMostGuesses> seeds;  // nearest first
        int count = 0;
    };
    struct FoundChain {
        Chain chain;
        ChainEvents events;
    };
    struct Found {
        std::array<FoundChain, kMostGuesses> chains;
        std::size_t count = 0;
    };
    Guesses guesses_at(const V3f& x, const V3f& n) const;
    // Returns different chains from x to y on a lamp.
    Found search(const SurfacePoint& x, const Guesses& guesses, std::uint32_t light, const V3f& y) const;
    void add_lamp(const Place& place, const Guesses& guesses, const Seed& seed, Sampler& sampler,
                  const PathAccount& account) const;

    const Scene& scene_;
    std::vector<Seed> seeds_;
    std::int64_t paths_;
    PhotonMap map_;
    float radius2_ = 0;
};

struct ChainParameters {
    std::int64_t paths = 0;  // light paths, in [1, 2^32]
    std::uint64_t seed = 0;
};
// Traces light paths and keeps those over specular surfaces from lamps that are seen as small. Returns null
// where there are too few, or if the monitor stopped it.
std::unique_ptr<const ChainGuide> build_chain_guide(const Scene& scene, const ChainParameters& parameters,
                                                    const Workers& workers, Monitor& monitor);

}  // namespace lucerna
