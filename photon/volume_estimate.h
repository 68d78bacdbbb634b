// In-scattered light from the photons of a Volume map: density estimation in space.
//
// Source: [Jensen and Christensen 1998]. It estimates ∇·L per scattering coefficient, from photons that count
// what arrives; here photons count what was scattered (albedo taken off), so their density times the phase
// function is what a ray gains per unit of length, and coefficients need not be known at the photons.
//
// Where we differ: a ball that reaches into a wall, or over the end of the medium, holds fewer photons than
// one in the open. The estimate is divided by the integral of σ_s over the part of the ball that is
// visible from its centre, over σ_s(centre) times the ball's volume; and photons that are not visible from
// the centre do not count. So fog is as bright at a wall as it is, and light does not leak through thin ones.
//
// That part is not known, it is looked for along a few directions; and the mean of 1/X is more than 1 over
// the mean of X, by as much as X scatters. So one of the directions is that in which a photon was found that
// counts, as for the probes of surfaces (probes.h): parts that are small are found as seldom as they are
// small. In symbols: let X_1 ... X_n be the parts along n directions, of mean m, and one of these drawn in
// proportion to its part, as evenly lit photons draw it. Then all of them together are drawn with the density
// X/m, X their mean, and the mean of 1/X is 1/m, exactly, but for the chance that n directions find nothing
// at all.
#pragma once

#include <span>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/medium.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/scene.h"
#include "kdtree/nearest.h"
#include "photon/photon_map.h"

namespace lucerna {

struct VolumeDensityEstimateSettings {
    int k = 100;                     // photons in an estimate, >= 1; 0: all within the radius
    float radius = 1;                // the largest radius, scene units, > 0
    int most_bounces = kMaxBounces;  // DensityEstimateSettings'
};

// Where in-scattered light is asked for.
struct ScatteringPoint {
    V3f p;
    HenyeyGreenstein phase;
    V3f wo;               // towards the eye
    std::int32_t medium;  // by medium interfaces
    Rgb sigma_s;          // of all media there, not black
};

// Conventions, as those of DensityEstimate: the k nearest count, and the next one fixes the radius r; for
// photons spread evenly k / (4/3 π r³) is then unbiased. With no more than k within the largest radius, that
// is the radius and all count; with k = 0 that holds wherever it is asked. The kernel is constant.
class VolumeDensityEstimate {
  public:
    VolumeDensityEstimate(const Scene& scene, const PhotonMap& map,
                          const VolumeDensityEstimateSettings& settings)
        : scene_(scene), map_(map), settings_(settings) {}

    struct Result {
        Rgb value{0.0F};   // radiance gained per unit of length towards wo, W/(m² sr) per scene unit
        float radius = 0;  // of the ball, scene units
        float filled = 1;  // its share that scatters and is seen, by what is scattered there
        int photons = 0;   // that counted
    };
    // Takes numbers from a branch of the sampler.
    Result in_scattered(const ScatteringPoint& at, const Sampler& sampler) const;
    // Books the value, too, on the path that the medium scatters there.
    Result in_scattered(const ScatteringPoint& at, const Sampler& sampler, const PathAccount& path) const;

  private:
    // A photon that was found, and what it brings towards the eye.
    struct Brought {
        V3f from;  // its place
        Rgb value;
        std::uint32_t light;
    };
    struct Filling {
        float share;      // of the ball
        bool obstructed;  // some surface stands in the ball
    };
    static std::size_t pick(std::span<const Brought> found, float u);
    Filling filling(const ScatteringPoint& at, float radius, const V3f& first, Sampler sampler) const;
    // Takes out those that are hidden.
    Filling filling(const ScatteringPoint& at, float radius, std::vector<Brought>& found,
                    const Sampler& sampler) const;
    double scattered_along(const ScatteringPoint& at, const Ray& ray, Sampler& sampler) const;
    Result sum(const ScatteringPoint& at, std::span<const Neighbour> found, float radius2,
               const Sampler& sampler, const PathAccount* path) const;
    Result found_around(const ScatteringPoint& at, const Sampler& sampler, const PathAccount* path) const;

    const Scene& scene_;
    const PhotonMap& map_;
    VolumeDensityEstimateSettings settings_;
};

}  // namespace lucerna
