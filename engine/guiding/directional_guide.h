// Importance for directions from photons [Jensen 1995; Vorba 2014].
//
// The photons around a point say from where light arrives there. Counted by direction they are a density by
// which rays that look for this light are drawn, in place of the cosine's. It is importance and nothing more:
// an even share of all directions stays in it (the defensive mixture), so that what no photon has told of is
// found, too, and estimates are unbiased.
//
// Histograms are made beforehand at some of the photons' own places (stations). A point takes the one of the
// nearest station that faces about the same way. Bins are cells of the unit square that the cosine hemisphere
// is warped from, of equal projected solid angle: photons of a surface that is lit evenly fill them evenly,
// and where a density over the square is even, a direction drawn by it is the one that a Lambertian surface
// draws of the same numbers. The square is warped by its rows and their cells, so numbers that are stratified
// stay so.
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

// A density over the unit square, constant in each of 16 x 16 cells.
class SquareHistogram {
  public:
    static constexpr std::size_t kSide = 16, kCells = kSide * kSide;

    // Even.
    SquareHistogram();
    // In proportion to the weights, by rows; all > 0 and finite. Cells lighter than some 1e-5 of the heaviest
    // come out heavier.
    explicit SquareHistogram(std::span<const float, kCells> weights);

    // u in [0,1)²; its place under the density, in [0,1)².
    V2f warp(const V2f& u) const;
    // At a place in [0,1]²: > 0, of mean 1.
    float density(const V2f& at) const;

  private:
    // Of the rows, and of the cells of each: the upper bounds of their shares but for the last, times 2^16.
    static constexpr float kWhole = 65536;
    using Bounds = std::array<std::uint16_t, kSide>;
    static Bounds bounds_of(std::span<const float, kSide> weights);
    Bounds rows_;
    std::array<Bounds, kSide> cells_;
};

// What guides the directions at one point. A value; refers to a histogram that lives elsewhere.
class DirectionGuide {
  public:
    DirectionGuide() = default;
    // `ns`: the shading normal on the side of wo, unit, to which the station's frame is turned.
    DirectionGuide(const SquareHistogram& histogram, const Frame& station, const V3f& ns);

    // Nothing to go by: the others must not be asked.
    bool empty() const { return !histogram_; }
    struct Sample {
        V3f wi;
        float pdf_w;
    };
    Sample sample(const V2f& u) const;
    // Density per solid angle; 0 below the shading normal's horizon.
    float pdf_w(const V3f& wi) const;

  private:
    const SquareHistogram* histogram_ = nullptr;
    Frame frame_;
};

struct DirectionGuiding {
    // Photons of a histogram, in [1, kMostPhotons].
    static constexpr int kMostPhotons = 1024;
    int k = 256;
    float radius = 1;  // largest distance at which photons and cache records are searched, scene units, > 0
    IndexKind index = IndexKind::tree;  // search structure of the photons and of the cache records
};

// Stations and their histograms. Constant, safe to share between threads.
class DirectionGuideMap {
  public:
    // A station for every few photons of the map. The map is not needed afterwards.
    DirectionGuideMap(const PhotonMap& map, const DirectionGuiding& settings, const Workers& workers);

    // At x, for what scatters towards wo; empty where no station is near, or where guiding does not pay.
    DirectionGuide at(const V3f& x, const Bsdf& bsdf, const V3f& wo) const;

    // Those at which guiding pays.
    std::size_t stations() const { return histograms_.size(); }
    std::size_t photons() const { return photons_; }  // that they are made of

  private:
    float radius_ = 0;
    std::size_t photons_ = 0;
    std::vector<V3f> places_;
    std::vector<PackedDirection> normals_;  // on the side that is lit
    std::vector<std::uint32_t> numbers_;    // of their histograms, or kNone: guiding does not pay there
    std::vector<SquareHistogram> histograms_;
    std::unique_ptr<PhotonIndex> index_;  // of the places by their normals; null: none
};

// Photons on surfaces with a diffuse part, as far as light samples, chosen among the lights as said, do not
// find them. `paths` light paths, in [1, 2^32]. Stopped early (monitor), it must not be used.
struct DirectionGuideParameters {
    std::int64_t paths = 0;
    std::uint64_t seed = 0;
    DirectionGuiding settings;
};
DirectionGuideMap build_direction_guides(const Scene& scene, const DirectionGuideParameters& parameters,
                                         const Workers& workers, Monitor& monitor);

// A BSDF seen from one side, whose directions a guide draws, too, or it alone where the guide is empty: one
// density, the mixture's, whichever drew. The guide stands in for the diffuse part, as often as that is
// drawn; everything else is drawn as ever. Refers to the BSDF and the guide's map.
class GuidedBsdf final : public DirectionDensity {
  public:
    GuidedBsdf(const Bsdf& bsdf, const V3f& wo, const DirectionGuide& guide);

    float pdf_w(const V3f& wi) const override;

    struct Sample {
        BsdfSample sample;  // the weight and pdf_w are those of the mixture
        float ratio = 1;    // its density over that of the BSDF's own sample()
    };
    // As Bsdf::sample for radiance.
    std::optional<Sample> sample(const BsdfU& u) const;

  private:
    const Bsdf& bsdf_;
    V3f wo_;
    DirectionGuide guide_;
    float share_;  // how often the guide draws; 0: never
};

}  // namespace lucerna
