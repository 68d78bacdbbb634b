#include "photon/gather.h"

#include "kdtree/nearest_heap.h"
#include "photon/shading_normals.h"

namespace lucerna {
namespace {

// Keeps the k nearest by the tangent metric while the tree looks for the nearest in space.
class NearestPhotons final : public PointVisitor {
  public:
    NearestPhotons(const PhotonMap& map, const TangentMetric& metric, std::size_t k, float radius2)
        : heap(k), map_(map), metric_(metric), radius2_(radius2) {}

    float visit(std::uint32_t index, float r2) override {
        const float d2 = metric_(map_.positions()[index], map_.photons()[index].direction.unpack(), r2);
        if (d2 < radius2_) heap.offer(d2, index);
        // A hair beyond the worst, so that ties are seen and decided by index, not by the order of the
        // search.
        return std::nextafter(metric_.ball2(std::min(radius2_, heap.worst())), INFINITY);
    }

    NearestHeap heap;

  private:
    const PhotonMap& map_;
    const TangentMetric& metric_;
    float radius2_;
};

}  // namespace

template <typename Carry>
GatherResult Gather::estimate(const V3f& x, const V3f& n, float error, Carry&& carry) const {
    const TangentMetric metric(x, n, settings_.metric, settings_.ratio);
    const float most2 = sqr(settings_.radius);
    // One more than k: it fixes the radius.
    const std::size_t places = std::min(static_cast<std::size_t>(settings_.k), map_.size()) + 1;
    NearestPhotons nearest(map_, metric, places, most2);
    map_.tree().visit_ball(x, metric.ball2(most2), nearest);

    const bool full = nearest.heap.full();
    const float r2 = std::max(full ? nearest.heap.worst() : most2, sqr(error));
    if (!(r2 > 0)) return {};

    // Sum nearest first: the order, and so the rounding, is the same however the tree was searched.
    GatherResult result;
    result.radius = std::sqrt(r2);
    const auto found = nearest.heap.sorted();
    const std::size_t count = full ? found.size() - 1 : found.size();
    for (std::size_t i = 0; i < count; ++i) {
        const Photon& photon = map_.photons()[found[i].index];
        result.value +=
            carry(photon, -photon.direction.unpack()) * kernel(settings_.kernel, found[i].key / r2);
    }
    result.value /= r2;
    result.photons = static_cast<int>(count);
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
