#include "photon/local_radius.h"

#include <algorithm>
#include <cmath>

#include "photon/near_photons.h"

namespace lucerna {
namespace {

// Every n-th photon: evenly spread, since a map is ordered in space.
Photons thinned(const PhotonMap& map, std::size_t points) {
    const std::size_t stride = std::max<std::size_t>((map.size() + points - 1) / points, 1);
    Photons some;
    for (std::size_t i = 0; i < map.size(); i += stride) {
        some.add(map.positions()[i], map.normals()[i], map.photons()[i]);
    }
    return some;
}

}  // namespace

LocalRadius::LocalRadius(const PhotonMap& map, const DensityEstimateSettings& how, std::size_t points,
                         const Workers& workers)
    : places_(thinned(map, points)), radii_(places_.size()), largest_(how.radius) {
    constexpr std::int64_t kGrain = 256;
    const auto count = static_cast<std::int64_t>(places_.size());
    parallel_ranges(workers, count, kGrain, [&](std::int64_t begin, std::int64_t end, std::int64_t) {
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
            const V3f& x = places_.positions()[i];
            const TangentMetric metric(x, places_.normals()[i].unpack(), how.metric, how.ratio);
            // The photon that stands here is one of those found: k more beside it.
            const auto k = static_cast<std::size_t>(how.k) + 1;
            const float r2 = NearPhotons(map, x, metric, k, sqr(how.radius)).radius2();
            // Where all of them lie at one point, a radius of 0 would never hold any other photon.
            radii_[i] = r2 > 0 ? std::sqrt(r2) : largest_;
        }
    });
}

double LocalRadius::mean() const {
    if (radii_.empty()) return double{largest_};
    double sum = 0;
    for (const float radius : radii_) sum += double{radius};
    return sum / static_cast<double>(radii_.size());
}

float LocalRadius::at(const V3f& x, const V3f& n) const {
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    const NearPhotons near(places_, x, metric, 1, sqr(largest_));
    return near.found().empty() ? largest_ : radii_[near.found().front().index];
}

}  // namespace lucerna
