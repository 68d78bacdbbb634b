#include "photon/gather.h"

#include <array>

#include "engine/base/frame.h"
#include "photon/near_photons.h"
#include "photon/shading_normals.h"

namespace lucerna {

template <typename Carry>
GatherResult Gather::estimate(const V3f& x, const V3f& n, float error, Carry&& carry) const {
    const TangentMetric metric(x, n, settings_.metric, settings_.ratio);
    const float most2 = sqr(settings_.radius);
    if (settings_.k == 0) {
        std::vector<Neighbour> found;
        map_.index().within(x, metric, most2, found);
        return sum({x, n, most2}, found, carry);
    }
    const NearPhotons near(map_, x, metric, static_cast<std::size_t>(settings_.k), most2);
    return sum({x, n, std::max(near.radius2(), sqr(error))}, near.found(), carry);
}

template <typename Carry>
GatherResult Gather::sum(const Disc& disc, std::span<const Neighbour> found, Carry&& carry) const {
    if (!(disc.r2 > 0)) return {};  // also where the square of a tiny radius is 0
    GatherResult result;
    result.radius = std::sqrt(disc.r2);
    result.photons = static_cast<int>(found.size());
    if (found.empty()) return result;
    for (const Neighbour& neighbour : found) {
        const Photon& photon = map_.photons()[neighbour.index];
        result.value +=
            carry(photon, -photon.direction.unpack()) * kernel(settings_.kernel, neighbour.key / disc.r2);
    }
    result.share = share(disc, found);
    result.value /= disc.r2 * result.share;  // the share is never 0
    return result;
}

float Gather::share(const Disc& disc, std::span<const Neighbour> found) const {
    switch (settings_.boundary) {
        case Boundary::none:
            return 1;
        case Boundary::hull: {
            const Frame frame(disc.n);
            const float scale = 1 / std::sqrt(disc.r2);
            std::vector<V2f> points;
            points.reserve(found.size() + 1);
            for (const Neighbour& neighbour : found) {
                const V3f q = crossing(disc.x, disc.n, map_.positions()[neighbour.index],
                                       map_.photons()[neighbour.index].direction.unpack(), settings_.metric);
                points.emplace_back(scale * frame.s.dot(q), scale * frame.t.dot(q));
            }
            return hull_share(settings_.kernel, points);
        }
        case Boundary::probes: {
            if (!scene_) return 1;
            std::array<V3f, kProbes> directions;
            const std::size_t count = std::min<std::size_t>(kProbes, found.size());
            for (std::size_t i = 0; i < count; ++i) {
                const std::uint32_t index = found[i * found.size() / count].index;
                directions[i] = map_.photons()[index].direction.unpack();
            }
            const TangentMetric metric(disc.x, disc.n, settings_.metric, settings_.ratio);
            return probed_share(*scene_, {disc.x, disc.n, disc.r2, metric.ball2(disc.r2), settings_.kernel},
                                metric, std::span(directions).first(count));
        }
    }
    return 1;
}

GatherResult Gather::radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo) const {
    const V3f n = hit.at.n.dot(wo) < 0 ? -hit.at.n : hit.at.n;
    if (bsdf.is_lambertian() && bsdf.shading_normal() == bsdf.geometric_normal()) {
        // The same for all photons that count, whichever way they came.
        GatherResult lit = irradiance({hit.at.p, n, hit.at.error});
        lit.value *= bsdf.f(wo, n, Transport::radiance);
        return lit;
    }
    return estimate(hit.at.p, n, hit.at.error, [&](const Photon& photon, const V3f& wi) {
        return bsdf.f(wo, wi, Transport::radiance) * photon.power * shading_cosine_ratio(bsdf, wi);
    });
}

GatherResult Gather::irradiance(const SurfacePoint& at) const {
    return estimate(at.p, at.n, at.error, [](const Photon& photon, const V3f&) { return photon.power; });
}

}  // namespace lucerna
