#include "photon/density_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/vec.h"
#include "photon/bounce.h"
#include "photon/photon_map.h"
#include "photon/photon_shares.h"

namespace lucerna {

bool irradiance_suffices(const Bsdf& bsdf) {
    constexpr float kSame = 1e-3F;  // rad
    return bsdf.is_lambertian() && (bsdf.shading_normal() - bsdf.geometric_normal()).length2() < sqr(kSame);
}

// Returns a photon's weight in the inner disc, of squared radius inner2 · r2, over its weight in the whole
// disc, of squared radius r2.
float more_within(KernelShape shape, float key, float r2, float inner2) {
    return key < inner2 * r2 ? kernel(shape, key / (inner2 * r2)) / (inner2 * kernel(shape, key / r2)) : 0.0F;
}

// Number of photons for which most estimates need no reallocation.
constexpr std::size_t kExpected = 256;

template <typename Carry>
DensityEstimateResult DensityEstimate::estimate(const V3f& x, const V3f& n, float error,
                                                Carry&& carry) const {
    const TangentMetric metric(x, n, settings_.metric, settings_.ratio);
    if (!radii_.empty()) return sample_point_estimate(metric, x, carry);
    const float most2 = sqr(settings_.radius);
    if (settings_.k == 0) {
        std::vector<Neighbour> found;
        found.reserve(kExpected);
        map_.index().within(x, metric, most2, found);
        return sum({x, n, most2, error}, found, carry);
    }
    const NearPhotons near(map_, x, metric, static_cast<std::size_t>(settings_.k), most2);
    return sum({x, n, std::max(near.radius2(), sqr(error)), error}, near.found(), carry);
}

template <typename Carry>
DensityEstimateResult DensityEstimate::sample_point_estimate(const TangentMetric& metric, const V3f& x,
                                                             Carry&& carry) const {
    std::vector<Neighbour> found;
    map_.index().within(x, metric, sqr(settings_.radius), found);
    DensityEstimateResult result;
    result.radius = settings_.radius;
    for (const Neighbour& neighbour : found) {
        const float r2 = sqr(radii_[neighbour.index]);
        if (!(neighbour.key < r2)) continue;  // also where the square of a tiny radius is 0
        if (!counts(neighbour.index)) continue;
        if (limits()) result.deepest = std::max(result.deepest, int{map_.bounces()[neighbour.index]});
        const Photon& photon = map_.photons()[neighbour.index];
        const Rgb brought =
            carry(photon, -photon.direction.unpack(), kernel(settings_.kernel, neighbour.key / r2) / r2);
        result.value += brought;
        if (settings_.sharper)
            result.sharper += more_within(settings_.kernel, neighbour.key, r2, sqr(kInnerRadius)) * brought;
        ++result.photons;
    }
    return result;
}

template <typename Carry>
DensityEstimateResult DensityEstimate::sum(const Disc& disc, std::span<const Neighbour> found,
                                           Carry&& carry) const {
    if (!(disc.r2 > 0)) return {};  // also where the square of a tiny radius is 0
    DensityEstimateResult result;
    result.radius = std::sqrt(disc.r2);
    result.photons = static_cast<int>(found.size());
    if (found.empty()) return result;
    // Bounds the inner radius from below by the surface's error, below which float32 resolves nothing.
    const float inner2 = std::max(sqr(kInnerRadius), sqr(disc.error) / disc.r2);
    for (const Neighbour& neighbour : found) {
        if (!counts(neighbour.index)) continue;
        if (limits()) result.deepest = std::max(result.deepest, int{map_.bounces()[neighbour.index]});
        const Photon& photon = map_.photons()[neighbour.index];
        const Rgb brought =
            carry(photon, -photon.direction.unpack(), kernel(settings_.kernel, neighbour.key / disc.r2));
        result.value += brought;
        if (settings_.sharper)
            result.sharper += more_within(settings_.kernel, neighbour.key, disc.r2, inner2) * brought;
    }
    const auto [share, part] = probed(disc, found);
    result.share = share;
    result.part = part;
    result.scale = part / (disc.r2 * share);  // the share is never 0
    result.value *= result.scale;
    if (!settings_.sharper) return result;
    result.sharper /= disc.r2;
    if (share == 1 && part == 1) return result;
    // The inner disc needs a boundary correction of its own: it may be complete though the outer one is cut
    // off.
    Disc inner = disc;
    inner.r2 *= inner2;
    std::vector<Neighbour> within;
    for (const Neighbour& neighbour : found) {
        if (neighbour.key < inner.r2) within.push_back(neighbour);
    }
    const auto [inner_share, inner_part] = probed(inner, within);
    result.sharper *= inner_part / inner_share;  // the share is never 0
    return result;
}

// Picks photons by systematic sampling, with probabilities proportional to their contributions.
std::span<const ProbedPhoton> DensityEstimate::pick(const Disc& disc, std::span<const Neighbour> found,
                                                    float shift, std::span<ProbedPhoton> picked) const {
    const auto brings = [&](const Neighbour& neighbour) {
        if (!counts(neighbour.index)) return 0.0F;
        return luminance(map_.photons()[neighbour.index].power) *
               kernel(settings_.kernel, neighbour.key / disc.r2);
    };
    float total = 0;
    for (const Neighbour& neighbour : found) total += brings(neighbour);
    std::size_t count = 0;
    float sum = 0;
    for (const Neighbour& neighbour : found) {
        sum += brings(neighbour);
        while (count < picked.size() &&
               sum * static_cast<float>(picked.size()) > (static_cast<float>(count) + shift) * total) {
            picked[count++] = {map_.positions()[neighbour.index],
                               map_.photons()[neighbour.index].direction.unpack()};
        }
    }
    return picked.first(count);
}

Probed DensityEstimate::probed(const Disc& disc, std::span<const Neighbour> found) const {
    switch (settings_.boundary) {
        case Boundary::none:
            return {1, 1};
        case Boundary::probes: {
            if (!probing_) return {1, 1};
            Sampler sampler = probing_->sampler;
            std::array<ProbedPhoton, kProbedPhotons> some;
            const std::span<const ProbedPhoton> picked =
                pick(disc, found, sampler.next(), std::span(some).first(settings_.probes.photons));
            if (picked.empty()) return {1, 1};
            const TangentMetric metric(disc.x, disc.n, settings_.metric, settings_.ratio);
            const ProbeNumbers turned{sampler.next(), sampler.next2()};
            const ProbedDisc asked{disc.x,           disc.n,    disc.r2, metric.ball2(disc.r2),
                                   settings_.kernel, disc.error};
            return probe(probing_->scene, asked, metric, picked, turned, settings_.probes);
        }
    }
    return {1, 1};
}

template <typename Each>
DensityEstimateResult DensityEstimate::radiance_of_each(const Hit& hit, const Bsdf& bsdf, const V3f& wo,
                                                        Each&& each) const {
    const SurfacePoint at = hit.at.facing(wo);
    const auto told = [&each](const Photon& photon, const Rgb& brought) {
        each(photon, brought);
        return brought;
    };
    if (bsdf.is_lambertian() && bsdf.shading_normal() == bsdf.geometric_normal()) {
        // The BRDF is the same for all photons that count. This short cut requires exactly equal normals, so
        // that it changes no value; irradiance_suffices() allows for the rounding of normals in files.
        const Rgb f = bsdf.f(wo, at.n, Transport::radiance);
        DensityEstimateResult lit =
            estimate(at.p, at.n, at.error, [&](const Photon& photon, const V3f&, float weight) {
                return told(photon, photon.power * weight);
            });
        lit.value *= f;
        lit.sharper *= f;
        return lit;
    }
    return estimate(at.p, at.n, at.error, [&](const Photon& photon, const V3f& wi, float weight) {
        return told(photon, bsdf.f(wo, wi, Transport::radiance) * photon.power *
                                shading_cosine_ratio(bsdf, wi) * weight);
    });
}

DensityEstimateResult DensityEstimate::radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo) const {
    return radiance_of_each(hit, bsdf, wo, [](const Photon&, const Rgb&) {});
}

DensityEstimateResult DensityEstimate::radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo, MapKind kind,
                                                const PathAccount& path) const {
    const Layer layer = kind == MapKind::direct    ? Layer::direct
                        : kind == MapKind::caustic ? Layer::caustic
                                                   : Layer::indirect;
    // Gloss that counted as specular for the Caustic map is no mirror for layers: its light is indirect.
    const bool by_straying = kind == MapKind::caustic && path.separates_caustics();
    if (!by_straying && !path.has_groups()) {
        const DensityEstimateResult result = radiance(hit, bsdf, wo);
        path.add_to_layer(layer, result.value);
        return result;
    }
    PhotonShares shares(path);
    const DensityEstimateResult result =
        radiance_of_each(hit, bsdf, wo, [&](const Photon& photon, const Rgb& brought) {
            shares.add(photon.light, photon.strayed != 0, brought);
        });
    if (by_straying) {
        path.add_to_layer(Layer::caustic, shares.part(result.value, false));
        path.add_to_layer(Layer::indirect, shares.part(result.value, true));
    } else {
        path.add_to_layer(layer, result.value);
    }
    shares.book_groups(result.value);
    return result;
}

DensityEstimateResult DensityEstimate::irradiance(const SurfacePoint& at) const {
    return estimate(at.p, at.n, at.error,
                    [](const Photon& photon, const V3f&, float weight) { return photon.power * weight; });
}

DensityEstimateResult DensityEstimate::incident(const SurfacePoint& at, IncidentLightSum& light,
                                                LateLight& late) const {
    IncidentLightSum found(at.n);
    LateLight found_late;
    const auto carry = [&](const Photon& photon, const V3f& wi, float weight) {
        const Rgb brought = photon.power * weight;
        found.add(brought, wi);
        if (limits()) {
            const auto index = static_cast<std::uint32_t>(&photon - map_.photons().data());
            const int spare = settings_.most_bounces - int{map_.bounces()[index]};  // >= 0: it counts
            for (auto j = static_cast<std::size_t>(spare); j < LateLight::kLevels; ++j)
                found_late.beyond[j] += luminance(brought);
        }
        return brought;
    };
    const DensityEstimateResult result = estimate(at.p, at.n, at.error, carry);
    light.add(found, result.scale);
    for (std::size_t j = 0; j < LateLight::kLevels; ++j)
        late.beyond[j] += result.scale * found_late.beyond[j];
    return result;
}

}  // namespace lucerna
