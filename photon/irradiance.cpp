#include "photon/irradiance.h"

#include <algorithm>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "engine/ranks/shared_work.h"
#include "engine/scene/path_limits.h"
#include "kdtree/box_tree.h"
#include "photon/deposit.h"

namespace lucerna {
namespace {

constexpr float kSameNormal = 0.9F;  // cosine
constexpr std::size_t kPlacesPerChunk = 1024;
// Bounds the specular and glossy bounces before a point. A path that finds none gives one point less, and no
// light is lost.
constexpr int kMostGlossyBounces = 8;

// Height of the origin of rays along a surface, in units of their length, so that a curved surface does not
// occlude them.
constexpr float kLift = 0.05F;

// Returns the distance up to which the light of a point, `all` of it, is about the same: a share of the
// distance of its lamps, and more if they give only a part of that light.
float far_enough(const NearLight& near, float all) {
    constexpr float kOfDistance = 0.25F;
    return near.irradiance > 0 ? kOfDistance * near.distance * std::max(all / near.irradiance, 1.0F)
                               : INFINITY;
}

// Returns the distance along the surface to the nearest object that stands on it, at most `most`. Objects
// thinner than the gaps between the rays are missed.
float free_distance(const Scene& scene, const SurfacePoint& at, float most) {
    constexpr int kRays = 8;
    constexpr float kBetweenRays =
        0.92F;  // cos(π/8): a wall across two rays is nearer than where they meet it
    const Frame frame(at.n);
    const V3f eye = at.p + (kLift * most + at.error) * at.n;
    float room = most;
    for (int i = 0; i < kRays; ++i) {
        const float phi = 2 * kPi * static_cast<float>(i) / kRays;
        const V3f way = cos(phi) * frame.s + sin(phi) * frame.t;
        const Ray ray{eye, way, room / kBetweenRays};
        if (const auto closest = scene.closest_hit(ray))
            room = std::min(room, kBetweenRays * scene.distance(ray, *closest));
    }
    return room;
}

// Returns a number made of the photon's direction, with 10 bits a side (2 mrad), so that rounding rarely
// changes it. It differs between photons because those of a Global map come from all directions.
std::uint32_t number_of(const Photon& photon) {
    constexpr std::uint32_t kSide = 0xffc0;
    return photon.direction.bits() & (kSide << 16 | kSide);
}

// Follows a ray from `from` along d, over specular and glossy surfaces, to the first surface with a diffuse
// part.
void land(const Scene& scene, SurfacePoint from, V3f d, std::uint32_t number, Sampler& sampler,
          SurfacePoints& places) {
    for (int bounce = 0; bounce < kMostGlossyBounces; ++bounce) {
        const auto hit = scene.intersect(Ray{from.towards(d), d});
        if (!hit) return;
        if (stores_photons(scene, *hit)) {
            places.add(hit->at.facing(-d), number);
            return;
        }
        const Bsdf bsdf = scene.bsdf(*hit);
        const BsdfU u{sampler.next(), sampler.next2()};
        const auto sample = bsdf.sample(-d, u, Transport::radiance);
        if (!sample || is_black(sample->weight)) return;
        from = hit->at;
        d = sample->wi;
    }
}

// Sorts points so that neighbours in space are neighbours in memory, for the index and for estimates, which
// then find the photons around them in the cache.
SurfacePoints in_order(const SurfacePoints& places, const Workers& workers) {
    SurfacePoints ordered;
    ordered.reserve(places.size());
    for (const std::uint32_t i : box_order(places.positions, workers)) {
        ordered.positions.push_back(places.positions[i]);
        ordered.normals.push_back(places.normals[i]);
        ordered.errors.push_back(places.errors[i]);
        ordered.numbers.push_back(places.numbers[i]);
    }
    return ordered;
}

}  // namespace

void SurfacePoints::reserve(std::size_t n) {
    positions.reserve(n);
    normals.reserve(n);
    errors.reserve(n);
    numbers.reserve(n);
}

void SurfacePoints::add(const SurfacePoints& more) {
    positions.insert(positions.end(), more.positions.begin(), more.positions.end());
    normals.insert(normals.end(), more.normals.begin(), more.normals.end());
    errors.insert(errors.end(), more.errors.begin(), more.errors.end());
    numbers.insert(numbers.end(), more.numbers.begin(), more.numbers.end());
}

SurfacePoints bounce_on(const Scene& scene, const PhotonMap& map, const BounceParameters& parameters,
                        const Workers& workers) {
    constexpr std::size_t kPhotons = 4 * kPlacesPerChunk;
    const auto count = static_cast<std::int64_t>(map.size());
    std::vector<SurfacePoints> parts(static_cast<std::size_t>((count + kPhotons - 1) / kPhotons));
    const float share = 1.0F / static_cast<float>(parameters.stride);
    const auto bounce = [&](std::int64_t chunk) {
        SurfacePoints& part = parts[static_cast<std::size_t>(chunk)];
        const auto begin = static_cast<std::size_t>(chunk * kPhotons);
        const std::size_t end = std::min(begin + kPhotons, map.size());
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t number = number_of(map.photons()[i]);
            Sampler sampler(parameters.seed, Purpose::gather, parameters.pass, number);
            if (sampler.next() >= share) continue;
            const V3f n = map.normals()[i].unpack();
            const V3f d = Frame(n).to_world(square_to_cosine_hemisphere(sampler.next2()));
            land(scene, surface_point_of(scene, map.positions()[i], n), d, number, sampler, part);
        }
    };
    shared_chunks(
        workers, "irradiance points", static_cast<std::int64_t>(parts.size()), ResultsGo::to_all_ranks,
        bounce, [&](std::int64_t chunk, auto& archive) { archive(parts[static_cast<std::size_t>(chunk)]); });
    SurfacePoints all;
    for (const SurfacePoints& part : parts) all.add(part);
    return all;
}

IrradiancePoints::IrradiancePoints(const SurfacePoints& places, const IrradianceSources& sources,
                                   const Workers& workers, Monitor& monitor)
    : scene_(sources.probing ? &sources.probing->scene : nullptr),
      most_bounces_(sources.how.most_bounces),
      places_(in_order(places, workers)),
      values_(places_.size()) {
    const std::size_t chunks = (size() + kPlacesPerChunk - 1) / kPlacesPerChunk;
    Phase phase(monitor, "irradiance", chunks);
    const auto estimate = [&](std::int64_t chunk) {
        if (monitor.stopped()) return;
        const std::size_t begin = static_cast<std::size_t>(chunk) * kPlacesPerChunk;
        for (std::size_t i = begin; i < std::min(begin + kPlacesPerChunk, size()); ++i) {
            const SurfacePoint at = places_[i];
            std::optional<Probing> probing = sources.probing;
            if (probing) probing->sampler = probing->sampler.split(places_.numbers[i]);
            IncidentLightSum sum(at.n);
            LateLight late;
            const DensityEstimateResult own =
                DensityEstimate(*sources.maps.front(), sources.how, probing).incident(at, sum, late);
            int deepest = own.deepest;
            for (const PhotonMap* map : sources.maps.subspan(1)) {
                const DensityEstimateResult more =
                    DensityEstimate(*map, sources.how, probing).incident(at, sum, late);
                deepest = std::max(deepest, more.deepest);
            }
            const NearLight near = sources.more ? sources.more(places_.numbers[i], at, sum) : NearLight();
            const IncidentLight light = sum.light();
            const float within = std::min(own.radius, far_enough(near, luminance(light.irradiance())));
            values_[i] = {light,
                          own.radius,
                          within,
                          scene_ ? free_distance(*scene_, at, own.radius) : INFINITY,
                          shares_of_shorter(late, luminance(light.irradiance())),
                          static_cast<BounceCount>(deepest)};
        }
    };
    shared_chunks(
        workers, "irradiance", static_cast<std::int64_t>(chunks), ResultsGo::to_all_ranks, estimate,
        [&](std::int64_t chunk, auto& archive) {
            const std::size_t begin = static_cast<std::size_t>(chunk) * kPlacesPerChunk;
            auto own =
                std::span(values_).subspan(begin, std::min<std::size_t>(kPlacesPerChunk, size() - begin));
            archive(own);
        },
        [&](std::int64_t more) { phase.advance(static_cast<std::uint64_t>(more)); });
    reach_ = reach_of_most();
    index_ =
        make_photon_index(sources.maps.front()->index_kind(), places_.positions, places_.normals, workers);
}

// Returns twice the median radius. A search without result visits all points within its radius, and where
// photons are few some discs are so wide that this would dominate the time.
float IrradiancePoints::reach_of_most() const {
    if (values_.empty()) return 0;
    std::vector<float> radii;
    for (const Value& value : values_) radii.push_back(value.radius);
    const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
    std::nth_element(radii.begin(), middle, radii.end());
    return 2 * *middle;
}

std::optional<IrradiancePoints::Found> IrradiancePoints::nearest(const V3f& x, const V3f& n, float radius,
                                                                 int most_bounces) const {
    const auto nearest = index_->nearest_facing(x, n, kSameNormal, sqr(std::min(radius, reach_)));
    if (!nearest) return std::nullopt;
    const Value& value = values_[nearest->index];
    const std::optional<float> share = share_within(value, most_bounces);
    if (!share) return std::nullopt;
    if (nearest->key > sqr(value.within)) return std::nullopt;
    if (nearest->key > sqr(value.room) && is_hidden(x, n, places_.positions[nearest->index])) {
        return std::nullopt;
    }
    return Found{value.light.irradiance(), value.radius, &value.light, *share};
}

std::array<std::uint16_t, LateLight::kLevels> IrradiancePoints::shares_of_shorter(const LateLight& late,
                                                                                  float all) {
    std::array<std::uint16_t, LateLight::kLevels> shares{};
    for (std::size_t j = 0; j < LateLight::kLevels; ++j) {
        const float share = all > 0 ? std::clamp(1 - late.beyond[j] / all, 0.0F, 1.0F) : 1.0F;
        shares[j] = static_cast<std::uint16_t>(share * kWhole + 0.5F);
    }
    return shares;
}

// Returns none if `most_bounces` is further below the points' limit than LateLight records.
std::optional<float> IrradiancePoints::share_within(const Value& value, int most_bounces) const {
    if (int{value.deepest} <= most_bounces) return 1.0F;
    const auto shorter = static_cast<std::size_t>(most_bounces_ - most_bounces);  // > 0: some are deeper
    if (shorter > LateLight::kLevels) return std::nullopt;
    return static_cast<float>(value.shorter[shorter - 1]) / kWhole;
}

bool IrradiancePoints::is_hidden(const V3f& x, const V3f& n, const V3f& point) const {
    const V3f way = point - x;
    return !scene_->unoccluded_along(x + kLift * way.length() * n, way);
}

namespace {

// Returns the error of the surface that p lies on within that error, met by a ray from `height` above p.
std::optional<float> error_hit_from(const Scene& scene, const V3f& p, const V3f& n, float height) {
    Ray down{p + height * n, -n, 2 * height};
    for (int i = 0; i < kMaxSheets && down.t_max > 0; ++i) {
        const auto hit = scene.intersect(down);
        if (!hit) return std::nullopt;
        // The factor 2 allows for the error of p and that of the hit.
        if (std::fabs((hit->at.p - p).dot(n)) <= 2 * hit->at.error) return hit->at.error;
        down = Ray{hit->at.towards(-n), -n, down.t_max - hit->t};
    }
    return std::nullopt;
}

}  // namespace

SurfacePoint surface_point_of(const Scene& scene, const V3f& p, const V3f& n) {
    // Twice the largest rounding error in the scene, then a height that also covers the error bound of a
    // thick curve.
    const float rounding = 2 * surface_error(p, diagonal(scene));
    for (const float height : {rounding, 1e3F * rounding}) {
        if (const auto error = error_hit_from(scene, p, n, height)) return {p, n, *error};
    }
    return {p, n, surface_error(p, 0)};
}

}  // namespace lucerna
