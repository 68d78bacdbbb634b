// Precomputes irradiance with its directions, so that a gather ray needs one look-up instead of a density
// estimate.
//
// Source: [Christensen 1999]. Radiosity changes slowly, and the values that gather rays hit are averaged over
// a hemisphere. The value at the nearest of these points, on the same side of a surface of about the same
// normal, is therefore as good as a density estimate at the hit.
//
// Occlusion counts, too. The nearest point may lie beyond a thin wall that a floor passes under, and its
// light is not that of this side. Each point stores its free distance along the surface; from further away it
// is looked up only if it is visible.
//
// A point is also wrong for places much farther from it than a lamp is: beside a ceiling panel that also
// shines up, the ceiling behind the panel is bright, but no one sees it. Each point stores the distance of
// its lamps.
//
// Placement. Christensen places a point at every n-th photon, which counts in its own estimate and makes it
// too bright by π kernel(0)/k = 2/k. Without that photon the estimate at the point is unbiased (Slivnyak's
// theorem), but the looked-up values are too dark: a point serves all places to which it is the nearest, so
// points in larger gaps, where photons happen to be few, serve more places. The two effects nearly cancel if
// all photons count (6 n/k² remains of 2/k), and 1.5/k remains if the own photon is left out. Points that are
// independent of the photons that they count have neither bias. Here a point is the end of one more diffuse
// bounce from one photon in n, which is also where gather rays end.
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

// Points on surfaces with a diffuse part, with normals on the lit side and bounds of their distance from the
// surface, which rays that leave from them need. Each has a number that selects its random numbers,
// independently of the other points.
struct SurfacePoints {
    std::vector<V3f> positions;
    std::vector<PackedDirection> normals;
    std::vector<float> errors;  // as of SurfacePoint
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
// Returns the end points of these bounces, continued over mirrors and gloss. Bounces that leave the scene
// give no point. The direction of a photon decides whether it is chosen, where its bounce goes and which
// number the point gets; its index in the map would not do, since rounding may change that of all photons.
// The result is the same for any number of threads.
SurfacePoints bounce_on(const Scene& scene, const PhotonMap& map, const BounceParameters& parameters,
                        const Workers& workers);

// Light from possibly near sources: how much, and from which (harmonic) mean distance. If a point moves by a
// share of that distance, this light changes by twice that share, whereas density estimates are already
// averaged over their discs.
struct NearLight {
    float irradiance = 0;  // luminance
    float distance = INFINITY;
};

// The sources whose light the points add up.
struct IrradianceSources {
    std::span<const PhotonMap* const> maps;  // one at least
    DensityEstimateSettings how;
    std::optional<Probing> probing = {};  // its sampler is split for each point; none: no occlusion test
    // Adds light beside that of the maps at the point of that number, if set. Called from any thread.
    std::function<NearLight(std::uint32_t number, const SurfacePoint& at, IncidentLightSum& light)> more = {};
};

class IrradiancePoints {
  public:
    // Computes at each of `places` the irradiance of all sources together; the radius is that of the first
    // map's estimate.
    IrradiancePoints(const SurfacePoints& places, const IrradianceSources& sources, const Workers& workers,
                     Monitor& monitor);

    struct Found {
        Rgb irradiance;              // W/m²
        float radius;                // of the estimate, scene units
        const IncidentLight* light;  // the same by direction; lives as long as the points
        float share;                 // of both, by paths within `most_bounces`
    };
    // Returns the nearest point within `radius` and within twice the median radius of the points, whose
    // normal is within about 25° of n, if x lies in the point's own disc and close to it compared to its
    // lamps, and is not hidden from it. If paths may have fewer bounces than the photons that count there
    // (`most_bounces` below the points' own limit), it gives their share in luminance. Returns none where the
    // caller must make an estimate of its own.
    std::optional<Found> nearest(const V3f& x, const V3f& n, float radius,
                                 int most_bounces = kMaxBounces) const;

    std::size_t size() const { return places_.size(); }

  private:
    struct Value {
        IncidentLight light;
        float radius;
        float within;  // largest distance from which it is looked up, scene units
        float room;    // free distance along the surface, scene units
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
    float reach_ = 0;                     // largest distance of a search, scene units
    std::unique_ptr<PhotonIndex> index_;  // the directions are the normals
};

// Returns the surface point at which a photon lies. A map keeps position and normal alone, but rays that
// leave from there need a bound of the distance from the surface.

// The bound depends on the surface: a triangle near the scene's centre may have a distant corner, and curves
// and instances add errors of their own. The surface is therefore searched along n. If it is not found, the
// error is that of rounding p alone.
SurfacePoint surface_point_of(const Scene& scene, const V3f& p, const V3f& n);

}  // namespace lucerna
