#include "photon/near_photons.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// Keeps the nearest by the tangent metric while the tree looks for the nearest in space.
class KeepNearest final : public PointVisitor {
  public:
    KeepNearest(const PhotonMap& map, const TangentMetric& metric, float most2, NearestHeap& heap)
        : map_(map), metric_(metric), most2_(most2), heap_(heap) {}

    float visit(std::uint32_t index, float r2) override {
        const float d2 = metric_(map_.positions()[index], map_.photons()[index].direction.unpack(), r2);
        if (d2 < most2_) heap_.offer(d2, index);
        // A hair beyond the worst, so that ties are seen and decided by index, not by the order of the
        // search.
        return std::nextafter(metric_.ball2(std::min(most2_, heap_.worst())), INFINITY);
    }

  private:
    const PhotonMap& map_;
    const TangentMetric& metric_;
    float most2_;
    NearestHeap& heap_;
};

}  // namespace

NearPhotons::NearPhotons(const PhotonMap& map, const V3f& x, const TangentMetric& metric, std::size_t k,
                         float most2)
    : heap_(std::min(k, map.size()) + 1), radius2_(most2) {  // one more than k: it fixes the radius
    KeepNearest nearest(map, metric, most2, heap_);
    map.tree().visit_ball(x, metric.ball2(most2), nearest);
    const bool full = heap_.full();
    if (full) radius2_ = heap_.worst();
    const std::span<const Neighbour> all = heap_.sorted();
    found_ = full ? all.first(all.size() - 1) : all;
}

}  // namespace lucerna
