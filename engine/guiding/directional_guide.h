// Guides directions by photons [Jensen 1995; Vorba 2014].
//
// The photons around a point tell from where light arrives there. Their histogram over directions is a
// density by which rays that look for this light are drawn, in place of the cosine's. It serves importance
// sampling only: a uniform share of all directions stays in it (the defensive mixture), so that light without
// photons is found, too, and estimates are unbiased.
//
// Histograms are made in advance at the positions of some of the photons (cache records). A point uses the
// nearest cache record that faces about the same way. Bins are cells of the unit square that is warped to the
// cosine hemisphere, of equal projected solid angle: the photons of an evenly lit surface fill them evenly,
// and where the density over the square is uniform, the direction drawn is the one that a Lambertian surface
// draws from the same numbers. The warp goes by rows and then by their cells, so that stratified numbers stay
// stratified.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/scene.h"
#include "engine/transport/direct_light.h"
#include "photon/photon_map.h"

namespace lucerna {

// Represents a density over the unit square, constant in each of 16 x 16 cells.
class SquareHistogram {
  public:
    static constexpr std::size_t kSide = 16, kCells = kSide * kSide;

    // Makes a uniform density.
    SquareHistogram();
    // Makes a density in proportion to the weights, row by row, all > 0 and finite. Cells lighter than about
    // 1e-5 of the heaviest get more than their share.
    explicit SquareHistogram(std::span<const float, kCells> weights);

    // Maps u in [0,1)² to a position in [0,1)² that is distributed by the density.
    V2f warp(const V2f& u) const;
    // Returns the density at a position in [0,1]²: > 0, of mean 1.
    float density(const V2f& at) const;

  private:
    // Hold cumulative shares of the rows, and of the cells of each row, times 2^16. The last one is implied.
    static constexpr float kWhole = 65536;
    using Bounds = std::array<std::uint16_t, kSide>;
    static Bounds bounds_of(std::span<const float, kSide> weights);
    Bounds rows_;
    std::array<Bounds, kSide> cells_;
};

// Guides the directions at one point. Cheap to copy; refers to a histogram that is kept elsewhere.
class DirectionGuide {
  public:
    DirectionGuide() = default;
    // `ns` is the unit shading normal on the side of wo, to which the cache record's frame is turned.
    DirectionGuide(const SquareHistogram& histogram, const Frame& record, const V3f& ns);

    // Tells whether there is no guide. The other functions must not be called then.
    bool empty() const { return !histogram_; }
    struct Sample {
        V3f wi;
        float pdf_w;
    };
    Sample sample(const V2f& u) const;
    // Returns the density per solid angle; 0 below the shading normal's horizon.
    float pdf_w(const V3f& wi) const;

  private:
    const SquareHistogram* histogram_ = nullptr;
    Frame frame_;
};

struct DirectionGuiding {
    // The number of photons in a histogram is in [1, kMostPhotons].
    static constexpr int kMostPhotons = 1024;
    int k = 256;
    float radius = 1;  // largest distance at which photons and cache records are searched, scene units, > 0
    IndexKind index = IndexKind::tree;  // acceleration structure of the photons and of the cache records
};

// Holds cache records and their histograms. Immutable, safe to share between threads.
class DirectionGuideMap {
  public:
    // Makes a cache record for every few photons of the map. The map is not needed afterwards.
    DirectionGuideMap(const PhotonMap& map, const DirectionGuiding& settings, const Workers& workers);

    // Returns the guide at x for scattering towards wo; empty if no cache record is near or guiding does not
    // pay.
    DirectionGuide at(const V3f& x, const Bsdf& bsdf, const V3f& wo) const;

    // Returns the number of cache records at which guiding pays.
    std::size_t records() const { return histograms_.size(); }
    std::size_t photons() const { return photons_; }  // of which the cache records are made

  private:
    float radius_ = 0;
    std::size_t photons_ = 0;
    std::vector<V3f> places_;
    std::vector<PackedDirection> normals_;  // on the lit side
    std::vector<std::uint32_t> numbers_;    // of their histograms, or kNone where guiding does not pay
    std::vector<SquareHistogram> histograms_;
    std::unique_ptr<PhotonIndex> index_;  // of the positions with their normals; null: none
};

// build_direction_guides() stores photons on surfaces with a diffuse part, as far as light samples do not
// find their light, from `paths` light paths, in [1, 2^32]. If the monitor stopped it, the result is useless.
struct DirectionGuideParameters {
    std::int64_t paths = 0;
    std::uint64_t seed = 0;
    DirectionGuiding settings;
};
DirectionGuideMap build_direction_guides(const Scene& scene, const DirectionGuideParameters& parameters,
                                         const Workers& workers, Monitor& monitor);

// Represents a BSDF seen from one side, mixed with a guide. Its density is that of the mixture, whichever of
// the two drew; with an empty guide it is the BSDF's. The guide replaces the diffuse part as often as that
// would be drawn; other lobes are drawn as usual. Refers to the BSDF and the guide's map.
class GuidedBsdf final : public DirectionDensity {
  public:
    GuidedBsdf(const Bsdf& bsdf, const V3f& wo, const DirectionGuide& guide);

    float pdf_w(const V3f& wi) const override;

    struct Sample {
        BsdfSample sample;  // the weight and pdf_w are those of the mixture
        float ratio = 1;    // density of the mixture over that of the BSDF's own sample()
    };
    // Samples like Bsdf::sample for radiance.
    std::optional<Sample> sample(const BsdfU& u) const;

  private:
    const Bsdf& bsdf_;
    V3f wo_;
    DirectionGuide guide_;
    float share_;  // probability that the guide draws; 0: never
};

}  // namespace lucerna
