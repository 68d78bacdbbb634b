#include "photon/local_radius.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/ranks/shared_work.h"
#include "photon/evenness.h"
#include "photon/irradiance.h"
#include "photon/probes.h"

namespace lucerna {
namespace {

// A place within this distance of a point, in radii of the point's disc, is assumed to have as complete a
// disc as the point. Points are closer than that, and the test of a point covers a disc larger by this much.
constexpr float kNeighbourhood = 0.35F;
// Least cosine between the normals of two places that count as lying in one plane.
constexpr float kSamePlane = 0.999F;

// Takes every n-th photon. They are evenly spread, since a map is ordered in space.
Photons thinned(const PhotonMap& map, std::size_t points) {
    const std::size_t stride = std::max<std::size_t>((map.size() + points - 1) / points, 1);
    Photons some;
    for (std::size_t i = 0; i < map.size(); i += stride) {
        some.add(map.positions()[i], map.normals()[i], map.photons()[i], map.bounces()[i]);
    }
    return some;
}

// Tests the photons within a disc, nearest first, for structure.
bool has_structure(const PhotonMap& map, const V3f& n, const TangentMetric& metric,
                   std::span<const Neighbour> found, float r2) {
    EvennessTest test(n);
    for (const Neighbour& neighbour : found) {
        const Photon& photon = map.photons()[neighbour.index];
        const V3f offset = metric.crossing(map.positions()[neighbour.index], photon.direction.unpack());
        test.add(offset, neighbour.key / r2, photon.power);
    }
    return test.finds_structure();
}

}  // namespace

LocalRadius::LocalRadius(const PhotonMap& map, const Parameters& parameters, const Workers& workers)
    : places_(thinned(map, parameters.points)),
      radii_(places_.size()),
      whole_(places_.size()),
      largest_(parameters.how.radius) {
    constexpr std::size_t kGrain = 64;
    const auto part = [this](std::int64_t chunk) {
        const std::size_t begin = static_cast<std::size_t>(chunk) * kGrain;
        return std::pair(begin, std::min(begin + kGrain, radii_.size()));
    };
    shared_chunks(
        workers, "first radii", static_cast<std::int64_t>((radii_.size() + kGrain - 1) / kGrain),
        ResultsGo::to_all_ranks,
        [&](std::int64_t chunk) {
            const auto [begin, end] = part(chunk);
            for (std::size_t i = begin; i < end; ++i) {
                radii_[i] = find_radius(map, parameters, i);
                whole_[i] = parameters.scene && find_whole(map, parameters, i);
            }
        },
        [&](std::int64_t chunk, auto& archive) {
            const auto [begin, end] = part(chunk);
            auto radii = std::span(radii_).subspan(begin, end - begin);
            auto whole = std::span(whole_).subspan(begin, end - begin);
            archive(radii, whole);
        });
}

float LocalRadius::find_radius(const PhotonMap& map, const Parameters& parameters, std::size_t point) const {
    const DensityEstimateSettings& how = parameters.how;
    const V3f& x = places_.positions()[point];
    const V3f n = places_.normals()[point].unpack();
    const TangentMetric metric(x, n, how.metric, how.ratio);
    const auto radius_of = [&](float r2) { return r2 > 0 ? std::sqrt(r2) : largest_; };
    // The photon at this point is one of those found, hence k others.
    const auto k = static_cast<std::size_t>(how.k) + 1;
    if (!parameters.wider_where_even) {
        // If all of them lie at one point, a radius of 0 would never hold any other photon.
        return radius_of(NearPhotons(map, x, metric, k, sqr(how.radius)).radius2());
    }
    const NearPhotons near(map, x, metric, k * kWider, sqr(how.radius));
    const std::span<const Neighbour> found = near.found();
    for (std::size_t count = k * kWider; count > k; count /= 2) {
        if (found.size() < count) continue;
        const float r2 = count < found.size() ? found[count].key : near.radius2();
        if (r2 > 0 && !has_structure(map, n, metric, found.first(count), r2)) return radius_of(r2);
    }
    return radius_of(k < found.size() ? found[k].key : near.radius2());
}

bool LocalRadius::find_whole(const PhotonMap& map, const Parameters& parameters, std::size_t point) const {
    const DensityEstimateSettings& how = parameters.how;
    const V3f n = places_.normals()[point].unpack();
    const SurfacePoint at = surface_point_of(*parameters.scene, places_.positions()[point], n);
    const TangentMetric metric(at.p, n, how.metric, how.ratio);
    const float r2 = sqr((1 + kNeighbourhood) * radii_[point]);
    std::vector<Neighbour> found;
    map.index().within(at.p, metric, r2, found);
    if (found.empty()) return false;
    std::array<ProbedPhoton, kProbedPhotons> some;
    for (std::size_t i = 0; i < some.size(); ++i) {
        const std::uint32_t photon = found[i * found.size() / some.size()].index;
        some[i] = {map.positions()[photon], map.photons()[photon].direction.unpack()};
    }
    Sampler sampler(parameters.seed, Purpose::importance, 0, point);
    const ProbeNumbers turned{sampler.next(), sampler.next2()};
    return is_whole(*parameters.scene, {at.p, n, r2, metric.ball2(r2), how.kernel, at.error}, metric, some,
                    turned);
}

double LocalRadius::mean() const {
    if (radii_.empty()) return double{largest_};
    double sum = 0;
    for (const float radius : radii_) sum += double{radius};
    return sum / static_cast<double>(radii_.size());
}

LocalRadius::At LocalRadius::at(const V3f& x, const V3f& n) const {
    const TangentMetric metric(x, n, MetricKind::euclidean, 1);
    const NearPhotons near(places_, x, metric, 1, sqr(largest_));
    if (near.found().empty()) return {largest_, false};
    const auto [index, r2] = near.found().front();
    const float radius = radii_[index];
    const bool whole = whole_[index] && r2 < sqr(kNeighbourhood * radius) &&
                       n.dot(places_.normals()[index].unpack()) > kSamePlane;
    return {radius, whole};
}

}  // namespace lucerna
