// Follows light over mirrors and smooth glass with the derivatives of the rays, and finds such chains between
// two places.
//
// A chain begins at a place x that scatters light otherwise, and leads over events at perfectly specular
// surfaces towards a lamp. Its first direction determines all the rest, so that a chain to a given place y is
// a root of the miss at y. Newton's method finds it by ray differentials [Igehy 1999], from the direction of
// a chain nearby [Jakob and Marschner 2012; Hanika et al. 2015].
#pragma once

#include <cstdint>
#include <optional>

#include "engine/base/sampler.h"
#include "engine/scene/media_traversal.h"
#include "engine/scene/scene.h"

namespace lucerna {

enum class SpecularEvent : std::uint8_t { reflection, refraction, straight };

// Holds what happens at the surfaces of a chain, in the order from x to the lamp.
class ChainEvents {
  public:
    static constexpr int kMost = 6;  // longer chains are hardly ever found

    int size() const { return size_; }
    SpecularEvent operator[](int i) const { return static_cast<SpecularEvent>(bits_ >> (2 * i) & 3U); }
    // Returns the number of events that count as bounces.
    int bounces() const {
        int count = 0;
        for (int i = 0; i < size_; ++i) count += (*this)[i] != SpecularEvent::straight;
        return count;
    }
    // Returns false, and changes nothing, if the chain is full.
    bool append(SpecularEvent event) {
        if (size_ == kMost) return false;
        bits_ |= static_cast<std::uint32_t>(event) << (2 * size_++);
        return true;
    }
    bool operator==(const ChainEvents& other) const { return bits_ == other.bits_ && size_ == other.size_; }

  private:
    std::uint32_t bits_ = 0;
    int size_ = 0;
};

// Holds the ray that leaves the last surface of a chain. Derivatives are by the first direction d along the
// axes of Frame(d): its change by (u, v) is u s + v t.
struct Chain {
    V3f first{0, 0, 1};  // direction at x, unit
    SurfacePoint from;   // the last surface
    V3f d{0, 0, 1};      // unit
    Rgb passed{1.0F};    // share of the radiance along the ray that the surfaces send to x
    float chance = 1;    // probability that Bsdf::sample() chooses these events
    V3d p_u{0.0}, p_v{0.0}, d_u{0.0}, d_v{0.0};

    Ray ray() const { return {from.towards(d), d}; }
    // Returns the solid angle at x per area perpendicular to the ray at distance t, sr per scene unit²;
    // infinite at a focus.
    double solid_angle_per_area(double t) const;
    // Tells whether another first direction (unit) whose chain leads to the same place at distance t is this
    // one, but for rounding, which matters near a focus.
    bool begins_as(const V3f& other, double t) const;
};

// Follows the chain that begins at x in a direction (unit). Returns none if it does not meet surfaces of
// these events.
std::optional<Chain> follow_chain(const Scene& scene, const SurfacePoint& x, const V3f& first,
                                  const ChainEvents& events);

// Finds the chain whose last ray passes through y, from a guess of the first direction (unit). Returns none
// if Newton's method does not converge.
std::optional<Chain> find_chain(const Scene& scene, const SurfacePoint& x, const V3f& guess,
                                const ChainEvents& events, const V3f& y);

// Estimates the transmittance of the media along a chain that begins in `medium` and whose last ray ends at
// `distance`. The chain must exist.
Rgb transmittance(const Scene& scene, const SurfacePoint& x, std::int32_t medium, const V3f& first,
                  const ChainEvents& events, float distance, Sampler& sampler);

// Describes the end of a chain at a lamp.
struct ChainEnd {
    Ray ray;         // the last one
    float t;         // its length
    const Hit* hit;  // of the surface that carries the lamp; null: the lamp has no geometry
};

class ChainSearch;

// Describes a chain that a path follows by chance from a place where lamps are also searched for. Without a
// search, `by` is null.
struct ChanceChain {
    const ChainSearch* by = nullptr;
    SurfacePoint x;
    V3f facing{0, 0, 1};  // geometric normal at x, on the side from which x was seen
    V3f first{0, 0, 1};   // direction at x
    float pdf_w = 0;      // density of that direction
    float chance = 1;     // of the search
    ChainEvents events;

    // Records what happens to the path at a surface.
    void turn(const Bsdf& bsdf, const BsdfSample& sample);
};

// Finds chains to lamps.
class ChainSearch {
  public:
    // Returns the weight of the light at the end of such a chain, where the search finds the rest.
    virtual float share(const ChanceChain& chain, std::uint32_t light, const ChainEnd& end) const = 0;

  protected:
    ~ChainSearch() = default;
};

}  // namespace lucerna
