#include "photon/gather.h"

#include "photon/near_photons.h"
#include "photon/shading_normals.h"

namespace lucerna {

template <typename Carry>
GatherResult Gather::estimate(const V3f& x, const V3f& n, float error, Carry&& carry) const {
    const TangentMetric metric(x, n, settings_.metric, settings_.ratio);
    const NearPhotons near(map_, x, metric, static_cast<std::size_t>(settings_.k), sqr(settings_.radius));
    const float r2 = std::max(near.radius2(), sqr(error));
    if (!(r2 > 0)) return {};

    GatherResult result;
    result.radius = std::sqrt(r2);
    for (const Neighbour& neighbour : near.found()) {
        const Photon& photon = map_.photons()[neighbour.index];
        result.value +=
            carry(photon, -photon.direction.unpack()) * kernel(settings_.kernel, neighbour.key / r2);
    }
    result.value /= r2;
    result.photons = static_cast<int>(near.found().size());
    return result;
}

GatherResult Gather::radiance(const Hit& hit, const Bsdf& bsdf, const V3f& wo) const {
    const V3f n = hit.at.n.dot(wo) < 0 ? -hit.at.n : hit.at.n;
    return estimate(hit.at.p, n, hit.at.error, [&](const Photon& photon, const V3f& wi) {
        return bsdf.f(wo, wi, Transport::radiance) * photon.power * shading_cosine_ratio(bsdf, wi);
    });
}

GatherResult Gather::irradiance(const SurfacePoint& at) const {
    return estimate(at.p, at.n, at.error, [](const Photon& photon, const V3f&) { return photon.power; });
}

}  // namespace lucerna
