// Precomputed irradiance, with its directions, so that a gather ray needs one look-up instead of an estimate.
//
// Source: [Christensen 1999]. Radiosity changes slowly, and what a gather ray hits is averaged over a
// hemisphere: the value at the nearest of these points, on the same side of a surface of about the same
// normal, is as good as an estimate of its own.
//
// Occlusion counts, too. The nearest point may stand beyond a thin wall that a floor goes through: its light
// is not that of this side. Each point stores its free distance along the surface; from further away it is
// looked up only if it is visible.
//
// Nor is a point right for places much farther from it than a lamp is: beside a ceiling's panel that also
// shines up, the ceiling behind it is bright, and seen by nobody. Each point knows how far away its lamps
// are.
//
// Where the points stand. Christensen takes every n-th photon, and that photon counts itself: its estimate is
// too bright by kernel(0)/k, 2/k. Leaving it out makes the estimate at the point unbiased (Slivnyak), and
// what is looked up too dark: a point is looked up from all places nearer to it than to another, so points
// with much room about them, where photons happen to be few, are looked up more often. The two nearly cancel
// with all photons counted (6 n/k² is left of 2/k), and that leaves 1.5/k without. Points that know nothing
// of the photons they count have neither: here they stand where one more diffuse bounce from one photon in n
// leads, which is also where gather rays go.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/scene/scene.h"
#include "photon/density_estimate.h"

namespace lucerna {

// Points on surfaces with a diffuse part, with the normals on the side that is lit and the bounds of how far
// they may lie off their surfaces: rays leave from there. Each has a number by which its chance goes,
// whatever others there are.
struct SurfacePoints {
    std::vector<V3f> positions;
    std::vector<PackedDirection> normals;
    std::vector<float> errors;  // SurfacePoint's
    std::vector<std::uint32_t> numbers;

    std::size_t size() const { return positions.size(); }
    void reserve(std::size_t n);
    void add(const SurfacePoint& at, std::uint32_t number) {
        positions.push_back(at.p);
        normals.emplace_back(at.n);
        errors.push_back(at.error);
        numbers.push_back(number);
    }
    void add(const SurfacePoints& more);
    template <typename Archive>
    void fields(Archive& archive) {
        archive(positions, normals, errors, numbers);
    }
    SurfacePoint operator[](std::size_t i) const { return {positions[i], normals[i].unpack(), errors[i]}; }
};

struct BounceParameters {
    std::size_t stride = 1;  // a bounce from one photon in n, >= 1
    std::uint64_t seed = 0;
    std::uint32_t pass = 0;
};
// The end points of these bounces, over mirrors and gloss as far as they are met; those that leave the scene
// make no place. Whether a photon is one of them, where its bounce goes and what number the place has, the
// direction it came from decides: not its place in the map, which rounding may change for all of them. The
// same for any number of threads.
SurfacePoints bounce_on(const Scene& scene, const PhotonMap& map, const BounceParameters& parameters,
                        const Workers& workers);

// Light from what may be near: how much, and from how far on (harmonic) average. It changes by twice its
// share of that distance, where a light of density is already a mean over its disc.
struct NearLight {
    float irradiance = 0;  // luminance
    float distance = INFINITY;
};

// The sources whose light the points add up.
struct IrradianceSources {
    std::span<const PhotonMap* const> maps;  // one at least
    DensityEstimateSettings how;
    std::optional<Probing> probing = {};  // by whose chance each point gets its own; none: what stands
                                          // between is not asked
    // Adds light beside that of the maps, at the place of that number; none: nothing. Called from any thread.
    std::function<NearLight(std::uint32_t number, const SurfacePoint& at, IncidentLightSum& light)> more = {};
};

class IrradiancePoints {
  public:
    // At every place the irradiance of all sources together; the radius is that of the first map's estimate.
    IrradiancePoints(const SurfacePoints& places, const IrradianceSources& sources, const Workers& workers,
                     Monitor& monitor);

    struct Found {
        Rgb irradiance;              // W/m²
        float radius;                // of the estimate, scene units
        const IncidentLight* light;  // the same by where it comes from; as long as the points live
        float share;                 // of both, that paths of so few bounces bring
    };
    // The nearest point within `radius`, and not much farther away than its disc is wide at most points,
    // whose normal is within some 25° of n, if x lies within that point's own disc, near it beside the lamps
    // that shine there, and nothing stands between. If paths may have fewer bounces than the photons
    // that count there (`most_bounces` below the points' own limit), it gives their share in luminance.
    // Returns none where the caller must make an estimate of its own.
    std::optional<Found> nearest(const V3f& x, const V3f& n, float radius,
                                 int most_bounces = kMaxBounces) const;

    std::size_t size() const { return places_.size(); }

  private:
    struct Value {
        IncidentLight light;
        float radius;
        float within;  // scene units: how far away it is looked up
        float room;    // a point so near is seen
        // Share of the irradiance that is left for paths that are shorter by j + 1 bounces (LateLight), times
        // kWhole.
        std::array<std::uint16_t, LateLight::kLevels> shorter;
        BounceCount deepest;  // of the photons that count
    };
    static constexpr float kWhole = 65535;
    static std::array<std::uint16_t, LateLight::kLevels> shares_of_shorter(const LateLight& late, float all);
    std::optional<float> share_within(const Value& value, int most_bounces) const;
    float reach_of_most() const;
    bool is_hidden(const V3f& x, const V3f& n, const V3f& point) const;

    const Scene* scene_;
    int most_bounces_;  // of the photons that count
    SurfacePoints places_;
    std::vector<Value> values_;
    float reach_ = 0;                     // how far away they are looked for
    std::unique_ptr<PhotonIndex> index_;  // by their normals
};

// Where a photon lies, as a surface point: a map keeps its place and normal, and rays that leave from there
// must know how far it may lie off its surface.

// That bound goes by what the surface is: a corner of it may be far away though the place is near the scene's
// middle, and curves and instances have more of their own. So the surface is looked for, along n, and asked.
// If it is not found, the error is that of p alone.
SurfacePoint surface_point_of(const Scene& scene, const V3f& p, const V3f& n);

}  // namespace lucerna
