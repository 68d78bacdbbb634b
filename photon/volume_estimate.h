// Estimates in-scattered light from the photons of a Volume map, by density estimation in space.
//
// Source: [Jensen and Christensen 1998], which estimates ∇·L per scattering coefficient from photons that
// carry the arriving power. Here photons carry the scattered power (after multiplication by the albedo), so
// that their density times the phase function is the radiance that a ray gains per unit of length, and the
// coefficients need not be known at the photons.
//
// Difference from the source: a ball that reaches into a wall, or beyond the end of the medium, holds fewer
// photons than one in the open. The estimate is therefore divided by the integral of σ_s over the part of the
// ball that is visible from its centre, over σ_s(centre) times the volume of the ball. Photons that are not
// visible from the centre do not count. Fog is thus correct beside a wall, and no light leaks through thin
// walls.
//
// This part is estimated along a few directions, and the mean of 1/X exceeds 1 over the mean of X, the more X
// scatters. One of the directions is therefore that of a photon that was found and counts, as for the probes
// of surfaces (probes.h), so that small parts are found as rarely as they are small. In symbols, let X_1 ...
// X_n be the parts along n directions, of mean m, one of them drawn in proportion to its part, as evenly lit
// photons draw it. Then all of them together have the density X/m, with X their mean, and the mean of 1/X is
// exactly 1/m, except for the probability that all n directions find nothing.
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
    int k = 100;                     // photons in an estimate, >= 1; 0: all photons within the radius
    float radius = 1;                // the largest radius, scene units, > 0
    int most_bounces = kMaxBounces;  // as of DensityEstimateSettings
};

// The point at which in-scattered light is estimated.
struct ScatteringPoint {
    V3f p;
    HenyeyGreenstein phase;
    V3f wo;               // towards the eye
    std::int32_t medium;  // by medium interfaces
    Rgb sigma_s;          // of all media there, not black
};

// Conventions are as for DensityEstimate: the k nearest photons count, and the next one fixes the radius r;
// for uniformly distributed photons k / (4/3 π r³) is then unbiased. If no more than k lie within the largest
// radius, that is the radius and all count; with k = 0 the radius is always the largest. The kernel is
// constant.
class VolumeDensityEstimate {
  public:
    VolumeDensityEstimate(const Scene& scene, const PhotonMap& map,
                          const VolumeDensityEstimateSettings& settings)
        : scene_(scene), map_(map), settings_(settings) {}

    struct Result {
        Rgb value{0.0F};   // radiance gained per unit of length towards wo, W/(m² sr) per scene unit
        float radius = 0;  // of the ball, scene units
        float filled = 1;  // visible share of the ball, weighted by σ_s
        int photons = 0;   // number of photons that count
    };
    // Returns the in-scattered radiance, with random numbers from a branch of the sampler.
    Result in_scattered(const ScatteringPoint& at, const Sampler& sampler) const;
    // Also books the value on the path that the medium scatters there.
    Result in_scattered(const ScatteringPoint& at, const Sampler& sampler, const PathAccount& path) const;

  private:
    // A photon that was found, with its contribution towards the eye.
    struct Brought {
        V3f from;  // its position
        Rgb value;
        std::uint32_t light;
    };
    struct Filling {
        float share;      // of the ball
        bool obstructed;  // some surface stands in the ball
    };
    static std::size_t pick(std::span<const Brought> found, float u);
    Filling filling(const ScatteringPoint& at, float radius, const V3f& first, Sampler sampler) const;
    // Also removes hidden photons.
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
