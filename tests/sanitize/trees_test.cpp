// Trees large enough to be built by several threads, with concurrent queries.
#include <gtest/gtest.h>

#include "kdtree/box_tree.h"
#include "photon/photon_map.h"
#include "tests/kdtree/clouds.h"

namespace lucerna {
namespace trees_test {

constexpr Workers kFour{4};

TEST(SmallTrees, BuiltAndAskedByFourThreads_AgreeWithFlann) {
    const std::vector<V3f> cloud = make_cloud(Cloud::random, 50'000, 1);
    std::vector<V3f> positions;
    for (const std::uint32_t old : box_order(cloud, kFour)) positions.push_back(cloud[old]);
    std::vector<PackedDirection> directions;
    for (const V3f& p : positions) {
        directions.emplace_back((p - V3f(0.5F, 0.5F, 2)).normalized());  // all arrive from above
    }
    const auto ours = make_photon_index(IndexKind::tree, positions, directions, kFour);
    const auto flanns = make_photon_index(IndexKind::flann, positions, directions, kFour);
    std::vector<int> alike(64);
    parallel_chunks(kFour, 64, [&](std::int64_t chunk) {
        Sampler sampler(8, Purpose::test, 0, static_cast<std::uint64_t>(chunk));
        const V3f x = place_near(positions, 1, sampler);
        const TangentMetric metric(x, {0, 0, 1}, MetricKind::projected, 2);
        const auto found_by = [&](const PhotonIndex& index) {
            Nearest found(20, 0.1F);
            index.nearest(x, metric, found);
            const auto sorted = found.sorted();
            return std::vector<Neighbour>(sorted.begin(), sorted.end());
        };
        const auto same = [](const Neighbour& a, const Neighbour& b) { return a.rank() == b.rank(); };
        const std::vector<Neighbour> a = found_by(*ours), b = found_by(*flanns);
        alike[static_cast<std::size_t>(chunk)] =
            !a.empty() && std::equal(a.begin(), a.end(), b.begin(), b.end(), same) ? 1 : 0;
    });
    EXPECT_EQ(alike, std::vector<int>(64, 1));
}

}  // namespace trees_test
}  // namespace lucerna
