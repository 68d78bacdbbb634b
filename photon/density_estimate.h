// Estimates radiance from a photon map by density estimation [Jensen 2001, 7].
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/scene/path_limits.h"
#include "engine/scene/scene.h"
#include "kdtree/nearest.h"
#include "photon/deposit.h"
#include "photon/incident_light.h"
#include "photon/photon_map.h"
#include "photon/probes.h"
#include "photon/tangent_metric.h"

namespace lucerna {

struct DensityEstimateSettings {
    int k = 100;       // photons in an estimate, >= 1; 0: all photons within the radius
    float radius = 1;  // the largest radius, scene units, > 0
    float ratio = 2;   // as of TangentMetric
    KernelShape kernel = KernelShape::epanechnikov;
    MetricKind metric = MetricKind::projected;
    Boundary boundary = Boundary::none;
    ProbeEffort probes = {};  // for Boundary::probes
    // Largest number of bounces of the photons that count. The other photons contribute to the size of the
    // disc, but not to the value.
    int most_bounces = kMaxBounces;
    bool sharper = false;  // whether DensityEstimateResult::sharper is computed
};

// Returns the largest radius of an estimate, in scene units: `set`, or a share of the scene's diagonal if it
// is 0.
inline constexpr float kDefaultRadius = 0.05F;
inline float largest_radius(float diagonal, float set = 0) {
    return set > 0 ? set : kDefaultRadius * diagonal;
}

// The scene and random numbers for Boundary::probes, which does nothing without them.
struct Probing {
    const Scene& scene;
    Sampler sampler;  // used by this estimate alone
};

inline constexpr float kInnerRadius = 0.25F;  // of DensityEstimateResult::sharper, relative to the disc's

// An estimate with the quantities that it rests on.
struct DensityEstimateResult {
    Rgb value{0.0F};  // radiance, W/(m² sr), or irradiance, W/m²
    // Estimate from the inner disc alone, of radius kInnerRadius · radius, if requested: with more noise and
    // less blur.
    Rgb sharper{0.0F};
    float radius = 0;  // of the disc, scene units
    int photons = 0;   // found in the disc
    float share = 1;   // share of the kernel that photons can reach, by which the boundary correction divides
    float part = 1;    // fraction of the found value that has reached the disc
    float scale = 0;   // factor from the kernel-weighted sum of the photons to the value
    int deepest = 0;   // most bounces of a photon that counts; set only if bounces are limited
};

// The light of the last bounces of the longest paths, if path lengths are limited (most_bounces): `beyond[j]`
// is the irradiance, W/m² of luminance, by photons that have bounced more than most_bounces - 1 - j times.
// The irradiance without them is that of paths that are shorter by j + 1.
struct LateLight {
    static constexpr std::size_t kLevels = 6;
    std::array<float, kLevels> beyond{};
};

// Conventions. The k nearest photons count, and the next one fixes the radius; for a uniform density this
// makes the estimate unbiased, because the k inside are uniform in the disc that the next one bounds. If no
// more than k lie within the largest radius, that is the radius, and all of them count. With k = 0 the radius
// is always the largest: all photons within it count, and the expected value is exactly the density blurred
// by the kernel. An empty map gives black. Photons that all lie at one point get a radius of at least the
// surface's error, below which float32 cannot tell points apart, never 0.
//
// Radii by photon. A radius that varies from place to place does not preserve flux. Where it grows away from
// a bright spot with slope s, estimates just outside still reach into the spot, and photons in its middle
// count 1 + 8s/15 times: 4 ∫ t (1 - t²) / (1 - s t) dt over [0, 1], for the Epanechnikov kernel and small s.
// If each photon has its own radius instead (the sample-point estimator of density [Silverman 1986, 5.3]), it
// is spread over its own disc and counts exactly once.

// Returns whether irradiance alone determines the radiance of a surface: it is exactly Lambertian, and its
// shading and geometric normals agree to the accuracy to which files give normals (1 mrad). With a bent
// normal, interpolated or from a relief, the radiance depends on the directions of the light.
bool irradiance_suffices(const Bsdf& bsdf);

class DensityEstimate {
  public:
    DensityEstimate(const PhotonMap& map, const DensityEstimateSettings& settings,
                    std::optional<Probing> probing = {})
        : map_(map), settings_(settings), probing_(probing) {}
    // Takes radii by photon: `radii` has one > 0 for each photon of the map, in scene units; the settings'
    // radius bounds the search. All photons found count, and there is no boundary correction.
    DensityEstimate(const PhotonMap& map, const DensityEstimateSettings& settings,
                    std::span<const float> radii)
        : map_(map), settings_(settings), radii_(radii) {}

    // Returns the radiance that the surface reflects towards `wo` from the map's photons.
    DensityEstimateResult radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo) const;
    // Also books the radiance on the path that has arrived there, for a map of that kind.
    DensityEstimateResult radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo, MapKind kind,
                                   const PathAccount& path) const;
    // Returns the irradiance at a point on the side of at.n, W/m².
    DensityEstimateResult irradiance(const SurfacePoint& at) const;
    // Also adds the irradiance to `light` by direction and to `late` by number of bounces.
    DensityEstimateResult incident(const SurfacePoint& at, IncidentLightSum& light, LateLight& late) const;

  private:
    // Computes radiance() and calls each(photon, brought) for each photon that counts, with contributions
    // relative to each other.
    template <typename Each>
    DensityEstimateResult radiance_of_each(const Hit& hit, const Bsdf& bsdf, const V3f& wo,
                                           Each&& each) const;
    struct Disc {
        V3f x, n;
        float r2;     // squared radius
        float error;  // of x, scene units
    };
    // Returns the density estimate of carry(photon, wi, weight), the contribution of each photon; wi points
    // back along the photon's path, and `weight` is that of the kernel.
    template <typename Carry>
    DensityEstimateResult estimate(const V3f& x, const V3f& n, float error, Carry&& carry) const;
    template <typename Carry>
    DensityEstimateResult sample_point_estimate(const TangentMetric& metric, const V3f& x,
                                                Carry&& carry) const;
    // Sums the contributions of photons found before.
    template <typename Carry>
    DensityEstimateResult sum(const Disc& disc, std::span<const Neighbour> found, Carry&& carry) const;
    std::span<const ProbedPhoton> pick(const Disc& disc, std::span<const Neighbour> found, float shift,
                                       std::span<ProbedPhoton> picked) const;
    Probed probed(const Disc& disc, std::span<const Neighbour> found) const;
    bool limits() const { return settings_.most_bounces < kMaxBounces; }
    bool counts(std::uint32_t photon) const {
        return !limits() || int{map_.bounces()[photon]} <= settings_.most_bounces;
    }

    const PhotonMap& map_;
    DensityEstimateSettings settings_;
    std::optional<Probing> probing_;
    std::span<const float> radii_;  // by photon; empty: a radius by place
};

}  // namespace lucerna
