#include "photon/probes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/scene/path_limits.h"
#include "photon/deposit.h"

namespace lucerna {
namespace {

// Returns the squared radius of the disc that holds a share u of the kernel; u in [0,1).
float kernel_radius2(KernelShape kernel, float u) {
    switch (kernel) {
        case KernelShape::constant:
            return u;
        case KernelShape::cone:  // 3ρ² - 2ρ³ = u
            return sqr(0.5F - sin(asin(1 - 2 * u) / 3));
        case KernelShape::epanechnikov:  // 2ρ² - ρ⁴ = u
            return 1 - std::sqrt(1 - u);
    }
    return 0;
}

// Returns sample `i` of `count` in the unit square, which the kernel's measure maps to the disc, from the
// centre outwards: a golden-ratio lattice, shifted on the torus.
V2f probe_place(int i, int count, const V2f& shift) {
    constexpr float kGolden = 0.61803399F;
    const V2f u((static_cast<float>(i) + shift.x) / static_cast<float>(count),
                static_cast<float>(i) * kGolden + shift.y);
    return {u.x, u.y - std::floor(u.y)};
}

// Returns the i-th of n stratified picks out of `count`; u in [0,1) gives the position in each stratum.
std::size_t pick(std::size_t i, std::size_t n, float u, std::size_t count) {
    const float place = (static_cast<float>(i) + u) * static_cast<float>(count) / static_cast<float>(n);
    return std::min(static_cast<std::size_t>(place), count - 1);
}

class Prober {
  public:
    Prober(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric)
        : scene_(scene),
          disc_(disc),
          metric_(metric),
          frame_(disc.n),
          lift_(std::max(0.02F * std::sqrt(disc.r2), kErrors * disc.error)),
          near2_(sqr(1.005F * std::sqrt(disc.r2) + kErrors * disc.error)),
          eye_(disc.x + lift_ * disc.n) {}

    // Returns the point, relative to x, that the kernel's measure assigns to u.
    V3f place(const V2f& u) const {
        const float rho = std::sqrt(kernel_radius2(disc_.kernel, u.x) * disc_.r2), phi = 2 * kPi * u.y;
        return rho * cos(phi) * frame_.s + rho * sin(phi) * frame_.t;
    }
    // Returns whether x sees the point y, relative to it.
    bool is_open(const V3f& y) const { return sees(eye_ + y); }
    // Returns whether a photon along d that crosses the disc at y, open or not, would have counted. All
    // points that x sees pass light on: if y is open, through it; otherwise onto a wall before it. Other
    // surfaces on the way to it do not matter, as the light may begin at one of them.
    bool counts(const V3f& y, bool open, const V3f& d) const {
        // Only the part of the path within the ball counts, from where it enters to where it leaves.
        const float middle = -y.dot(d);
        const float half = std::sqrt(std::max(0.0F, sqr(middle) + disc_.ball2 - y.length2()));
        const V3f p = disc_.x + y;
        const float back = back_along(d);
        return (open && rests_under({p - back * d, d, 2 * back + middle + half})) ||
               rests_over({p + (middle - half) * d, d, half - middle - rounding_along(d)});
    }
    // Returns whether x sees that the surface continues at y in the plane of the disc, where any photon would
    // have counted.
    bool goes_on(const V3f& y) const {
        constexpr float kFlat = 0.1F;  // in units of the eye's height
        const V3f way = disc_.x + y - eye_;
        const float distance = way.length();
        if (!(distance > 0)) return false;
        const auto hit = scene_.intersect(Ray{eye_, way / distance, 1.2F * distance});
        return hit && std::fabs(disc_.n.dot(hit->at.p - disc_.x)) < kFlat * lift_ + disc_.error &&
               stores_photons(scene_, *hit);
    }
    // Returns whether a photon that was found counts.
    bool counts(const ProbedPhoton& photon) const {
        const V3f back = back_along(photon.d) * photon.d;
        const V3f deposited = photon.p - back;
        if (rises(photon.p)) return sees(deposited);
        const V3f crossed = disc_.x + metric_.crossing(photon.p, photon.d) - back;
        if (!sees(crossed)) return false;
        return (deposited - crossed).length2() < sqr(lift_) || is_clear(crossed, deposited);
    }

  private:
    // Multiple of the surface's error: x is off by one, the hit of a ray by another.
    static constexpr float kErrors = 2;

    // Returns whether a photon on this way is stored within the disc. Glass and other transmitting surfaces
    // are no edge: photons lie beyond them, by this way or by another one that is refracted.
    bool rests_under(Ray way) const {
        for (int i = 0; i < kMaxSheets; ++i) {
            const auto hit = scene_.intersect(way);
            if (!hit) return false;
            if (stores_photons(scene_, *hit)) return is_near(*hit, way.d);
            if (!scene_.bsdf(*hit).transmits()) return false;
            way = beyond(*hit, way);
        }
        return false;
    }
    // Returns whether x sees a point at which the photon may be stored on this way, which ends above the
    // plane: whether a ray that ends on a surface hits it is a matter of rounding.
    bool rests_over(Ray way) const {
        for (int i = 0; i < kMaxSheets && way.t_max > 0; ++i) {
            const auto hit = scene_.intersect(way);
            if (!hit) return false;
            if (stores_photons(scene_, *hit) && is_near(*hit, way.d) &&
                sees(hit->at.p - back_along(way.d) * way.d)) {
                return true;
            }
            way = beyond(*hit, way);
        }
        return false;
    }
    // Returns how far back along d a ray must begin to hit a surface at a given point: far enough to be above
    // it by more than rounding, however flat d is.
    float back_along(const V3f& d) const { return std::max(lift_, rounding_along(d)); }
    // Returns the distance from a point within which rounding decides whether a ray along d hits the surface
    // there.
    float rounding_along(const V3f& d) const {
        constexpr float kOfRadius = 1e-3F;
        return std::max(kOfRadius * std::sqrt(disc_.r2),
                        kErrors * disc_.error / std::max(-disc_.n.dot(d), kGrazing));
    }
    // The bound is slightly larger than the disc, so that on a flat surface every probe counts despite
    // rounding.
    bool is_near(const Hit& hit, const V3f& d) const {
        return metric_(hit.at.p, d, (hit.at.p - disc_.x).length2()) <= near2_;
    }
    static Ray beyond(const Hit& hit, const Ray& way) {
        return {hit.at.towards(way.d), way.d, way.t_max - hit.t};
    }
    // Returns whether the point is visible from the eye, just above x.
    bool sees(const V3f& p) const { return is_clear(eye_, p); }
    bool is_clear(const V3f& from, const V3f& to) const { return scene_.unoccluded_along(from, to - from); }
    // Returns whether the point lies above the plane of the disc.
    bool rises(const V3f& p) const { return disc_.n.dot(p - disc_.x) > 0; }

    const Scene& scene_;
    const ProbedDisc& disc_;
    const TangentMetric& metric_;
    Frame frame_;
    float lift_;   // height of the eye above x, scene units
    float near2_;  // squared distance up to which a hit lies in the disc
    V3f eye_;
};

// Returns whether the rim is open. Edges and walls cut off the rim first, so if it is open, so is the rest.
// Each of two directions is tested at opposite points, since `places` is a multiple of 4; of two opposite
// points one lies beyond any nearby edge.
bool has_whole_rim(const Prober& prober, std::span<const ProbedPhoton> photons, const ProbeNumbers& u,
                   std::size_t places) {
    bool whole = true;
    for (std::size_t i = 0; whole && i < places; ++i) {
        const V2f rim(0.75F + 0.25F * u.place.x,
                      (static_cast<float>(i) + u.place.y) / static_cast<float>(places));
        const V3f y = prober.place(rim);
        whole =
            prober.goes_on(y) ||
            (prober.is_open(y) && prober.counts(y, true, photons[pick(i % 2, 2, u.first, photons.size())].d));
    }
    return whole;
}

}  // namespace

bool is_whole(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
              std::span<const ProbedPhoton> photons, const ProbeNumbers& u) {
    constexpr std::size_t kRimPlaces = 8;
    const Prober prober(scene, disc, metric);
    // Tests points close to the rim itself.
    const ProbeNumbers outermost{u.first, {0.95F, u.place.y}};
    return has_whole_rim(prober, photons, outermost, kRimPlaces) &&
           std::all_of(photons.begin(), photons.end(),
                       [&](const ProbedPhoton& photon) { return prober.counts(photon); });
}

Probed probe(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
             std::span<const ProbedPhoton> photons, const ProbeNumbers& u, const ProbeEffort& effort) {
    const Prober prober(scene, disc, metric);
    const std::size_t count = photons.size();

    const bool whole = has_whole_rim(prober, photons, u, 4);
    std::array<V3f, kProbedPhotons> seen;
    // A few photons suffice if nothing near could occlude any.
    const std::size_t asked = whole ? (count + 3) / 4 : count;
    std::size_t counted = 0;
    for (std::size_t i = 0; i < asked; ++i) {
        const ProbedPhoton& photon = photons[pick(i, asked, u.first, count)];
        if (prober.counts(photon)) seen[counted++] = photon.d;
    }
    if (counted == 0) return {1, 0};
    const float part = static_cast<float>(counted) / static_cast<float>(asked);
    if (whole) return {1, part};

    // All directions use the same points, so that variation common to them does not scatter their shares.
    const std::size_t directions = std::min(counted, effort.directions);
    float sum = 0;
    std::array<int, kProbedPhotons> arrived{};
    for (int i = 0; i < effort.places; ++i) {
        const V3f y = prober.place(probe_place(i, effort.places, u.place));
        const bool open = prober.is_open(y);
        for (std::size_t j = 0; j < directions; ++j)
            arrived[j] += prober.counts(y, open, seen[pick(j, directions, u.first, counted)]);
    }
    for (std::size_t j = 0; j < directions; ++j) {
        sum += static_cast<float>(effort.places) /
               static_cast<float>(std::max(arrived[j], 1));  // at least the photon itself
    }
    return {static_cast<float>(directions) / sum, part};
}

}  // namespace lucerna
