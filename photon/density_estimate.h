// Radiance from a photon map by density estimation [Jensen 2001, 7].
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
    int k = 100;       // photons in an estimate, >= 1; 0: all within the radius
    float radius = 1;  // the largest radius, scene units, > 0
    float ratio = 2;   // TangentMetric's
    KernelShape kernel = KernelShape::epanechnikov;
    MetricKind metric = MetricKind::projected;
    Boundary boundary = Boundary::none;
    ProbeEffort probes = {};  // of Boundary::probes
    // Largest number of bounces of the photons that count. The other photons contribute to the size of the
    // disc, but not to the value.
    int most_bounces = kMaxBounces;
    bool sharper = false;  // whether DensityEstimateResult::sharper is wanted
};

// The largest radius of an estimate: what is set, scene units, or a share of the scene's diagonal where
// nothing is (0).
inline constexpr float kDefaultRadius = 0.05F;
inline float largest_radius(float diagonal, float set = 0) {
    return set > 0 ? set : kDefaultRadius * diagonal;
}

// The scene and random numbers for Boundary::probes, which does nothing without them.
struct Probing {
    const Scene& scene;
    Sampler sampler;  // the estimate's own, whose numbers nobody else draws
};

inline constexpr float kSharper = 0.25F;

// An estimate with the quantities that it rests on.
struct DensityEstimateResult {
    Rgb value{0.0F};  // radiance, W/(m² sr), or irradiance, W/m²
    // The same by the photons in the disc's inner part alone, kSharper of its radius, if that is wanted: with
    // more noise, and less blur.
    Rgb sharper{0.0F};
    float radius = 0;  // of the disc, scene units
    int photons = 0;   // that counted
    float share = 1;   // of the kernel, by which the boundary correction divided
    float part = 1;    // of the value found that counted
    float scale = 0;   // of the photons' sum, kernel included: what makes it the value
    int deepest = 0;   // bounces before a photon that counts, at the most; told where they are limited
};

// The light of the last bounces of the longest paths, if path lengths are limited (most_bounces): `beyond[j]`
// is the irradiance, W/m² of luminance, by photons that have bounced more than most_bounces - 1 - j times.
// The irradiance without them is that of paths that are shorter by j + 1.
struct LateLight {
    static constexpr std::size_t kLevels = 6;
    std::array<float, kLevels> beyond{};
};

// Conventions. The k nearest photons count, and the next one fixes the radius; for a uniform density that
// makes the estimate unbiased (the k inside are uniform in the disc of the one that is not). With no more
// than k within the largest radius, that is the radius and all count. With k = 0 the largest radius is the
// radius wherever it is asked: all photons within it count, and the estimate is the density blurred by the
// kernel, exactly in the mean. An empty map gives black. Photons that all lie at one point get the radius
// below which float32 cannot tell points apart (the surface's own error), never 0.
//
// Radii by photon. A radius that varies from place to place does not keep the flux: where it grows away from
// a bright spot with slope s, those just outside still reach into the spot, and photons in its middle count
// 1 + 8s/15 times: 4 ∫ t (1 - t²) / (1 - s t) dt over [0, 1], for Epanechnikov's kernel and small s. Where
// each photon is given the radius instead (the sample-point estimator of density [Silverman 1986, 5.3]), each
// is spread over its own disc and counts once exactly.

// Whether irradiance says all there is to know about what arrives at a surface: it is exactly Lambertian, and
// shaded by its own normal, but for how exactly files give normals (1 mrad). A bent normal, be it
// interpolated or by a relief, weighs light from either side differently, and by how much no sum over
// directions tells.
bool irradiance_suffices(const Bsdf& bsdf);

class DensityEstimate {
  public:
    DensityEstimate(const PhotonMap& map, const DensityEstimateSettings& settings,
                    std::optional<Probing> probing = {})
        : map_(map), settings_(settings), probing_(probing) {}
    // Radii by photon: `radii` has one of each of the map's, scene units, > 0; the settings' radius says how
    // far away they are looked for. All found count; there is no boundary correction.
    DensityEstimate(const PhotonMap& map, const DensityEstimateSettings& settings,
                    std::span<const float> radii)
        : map_(map), settings_(settings), radii_(radii) {}

    // Radiance that the surface sends towards `wo` because of the map's photons.
    DensityEstimateResult radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo) const;
    // The same for a map of that kind, booked on the path that has arrived there.
    DensityEstimateResult radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo, MapKind kind,
                                   const PathAccount& path) const;
    // Irradiance at a point on the side of at.n, W/m².
    DensityEstimateResult irradiance(const SurfacePoint& at) const;
    // The same, added to `light` by where it comes from, and to `late` by how far.
    DensityEstimateResult incident(const SurfacePoint& at, IncidentLightSum& light, LateLight& late) const;

  private:
    // radiance(), and calls each(photon, brought) for what counts: in any unit, the same for all.
    template <typename Each>
    DensityEstimateResult radiance_of_each(const Hit& hit, const Bsdf& bsdf, const V3f& wo,
                                           Each&& each) const;
    struct Disc {
        V3f x, n;
        float r2;     // squared radius
        float error;  // of x
    };
    // The density estimate of whatever `carry(photon, wi, weight)` says each photon brings, wi pointing back
    // along its way, the kernel's weight included.
    template <typename Carry>
    DensityEstimateResult estimate(const V3f& x, const V3f& n, float error, Carry&& carry) const;
    template <typename Carry>
    DensityEstimateResult sample_point_estimate(const TangentMetric& metric, const V3f& x,
                                                Carry&& carry) const;
    // Sums photons that were found before.
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
    std::span<const float> radii_;  // by photon; empty: one radius by place
};

}  // namespace lucerna
