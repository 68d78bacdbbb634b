// Tests that every index finds the same photons, bit for bit, as a search of all photons.
#include "photon/photon_map.h"

#include <gtest/gtest.h>

#include "engine/base/warp.h"
#include "tests/kdtree/clouds.h"

namespace lucerna {
namespace photon_index_test {

// Returns photons in a cloud, from all directions, some of them at grazing angles to the z plane or along -z.
Photons make_photons(Cloud kind, std::size_t n, float scale) {
    Sampler sampler(1, Purpose::test, static_cast<std::uint32_t>(kind), n);
    Photons deposited;
    for (const V3f& p : make_cloud(kind, n, scale)) {
        V3f d = square_to_sphere(sampler.next2());
        if (sampler.next() < 0.3F) d = V3f(d.x, d.y, -1e-3F).normalized();
        if (sampler.next() < 0.1F) d = V3f(0, 0, -1);
        deposited.add(p, PackedDirection(square_to_sphere(sampler.next2())),
                      {PackedDirection(d), Rgb(1), 0, kNoCell});
    }
    return deposited;
}

struct Search {
    V3f x, n;
    TangentMetric metric;
    float most2;
};

Search make_search(const PhotonMap& map, float scale, MetricKind kind, Sampler& sampler) {
    const std::vector<V3f> points(map.positions().begin(), map.positions().end());
    const V3f x = place_near(points, scale, sampler);
    const V3f n = sampler.next() < 0.5F ? V3f(0, 0, 1) : square_to_sphere(sampler.next2());
    const float ratio = sampler.next() < 0.5F ? 2 : 1 + 3 * sampler.next();
    const float u = sampler.next();
    const float most2 = u < 0.2F ? INFINITY : sqr((0.02F + u) * scale);
    return {x, n, TangentMetric(x, n, kind, ratio), most2};
}

// Finds the photons by definition.
std::vector<Neighbour> visit_all(const PhotonMap& map, const Search& search) {
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < map.size(); ++i) {
        const V3f& p = map.positions()[i];
        const V3f d = PackedDirection::along(map.photons()[i].direction.bits());
        const float key = search.metric(p, d, (p - search.x).length2());
        if (key < search.most2) all.push_back({i, key});
    }
    return all;
}

void expect_equal(std::span<const Neighbour> found, std::span<const Neighbour> expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i].rank(), expected[i].rank()) << i;
}

class PhotonIndexClouds : public ::testing::TestWithParam<std::tuple<Cloud, float, MetricKind>> {};

TEST_P(PhotonIndexClouds, TreeAndFlann_EqualALookAtEveryPhoton) {
    const auto [kind, scale, metric] = GetParam();
    for (const std::size_t n : {0U, 1U, 2U, 100U, 3000U}) {
        const Photons deposited = make_photons(kind, n, scale);
        const PhotonMap maps[] = {PhotonMap(deposited, IndexKind::tree),
                                  PhotonMap(deposited, IndexKind::flann)};
        Sampler sampler(2, Purpose::test, 0, n);
        for (int query = 0; query < 30; ++query) {
            const Search search = make_search(maps[0], scale, metric, sampler);
            const std::vector<Neighbour> by_index = visit_all(maps[0], search);
            std::vector<Neighbour> by_distance = by_index;
            std::sort(by_distance.begin(), by_distance.end());
            for (const PhotonMap& map : maps) {
                std::vector<Neighbour> within;
                map.index().within(search.x, search.metric, search.most2, within);
                expect_equal(within, by_index);
                for (const std::size_t k : {std::size_t{1}, std::size_t{20}, std::size_t{300}, n + 5}) {
                    const NearPhotons near(map, search.x, search.metric, k, search.most2);
                    const std::size_t expected = std::min(k, by_distance.size());
                    expect_equal(near.found(), std::span(by_distance).first(expected));
                    const float next = k < by_distance.size() ? by_distance[k].key : search.most2;
                    EXPECT_EQ(near.radius2(), next);
                }
            }
        }
    }
}

TEST_P(PhotonIndexClouds, NearestFacing_EqualsALookAtEveryNormal) {
    const auto [kind, scale, metric] = GetParam();
    const PhotonMap map(make_photons(kind, 2000, scale));
    const std::vector<V3f> points(map.positions().begin(), map.positions().end());
    const auto tree = make_photon_index(IndexKind::tree, points, map.normals(), Workers{2});
    const auto flann = make_photon_index(IndexKind::flann, points, map.normals(), Workers{2});
    const auto brute = make_photon_index(make_brute_force(points), points, map.normals());
    Sampler sampler(3, Purpose::test, 0, 0);
    int found = 0;
    for (int query = 0; query < 200; ++query) {
        const Search search = make_search(map, scale, metric, sampler);
        const float cosine = query % 2 == 0 ? 0.9F : 0.999F;
        const auto expected = brute->nearest_facing(search.x, search.n, cosine, search.most2);
        if (expected) {
            ++found;
            const V3f normal = map.normals()[expected->index].unpack();
            EXPECT_GT(normal.dot(search.n), cosine - 1e-4F);
        }
        for (const PhotonIndex* index : {tree.get(), flann.get()}) {
            const auto nearest = index->nearest_facing(search.x, search.n, cosine, search.most2);
            ASSERT_EQ(nearest.has_value(), expected.has_value());
            if (nearest) {
                EXPECT_EQ(nearest->rank(), expected->rank());
            }
        }
    }
    EXPECT_GT(found, 20);
}

// These searches use no metric.
class PhotonIndexInSpace : public ::testing::TestWithParam<std::tuple<Cloud, float>> {};

// Photons in media count for any direction.
TEST_P(PhotonIndexInSpace, EqualsALookAtEveryPhoton) {
    const auto [kind, scale] = GetParam();
    int found = 0;
    for (const std::size_t n : {0U, 1U, 100U, 3000U}) {
        const Photons deposited = make_photons(kind, n, scale);
        const PhotonMap maps[] = {PhotonMap(deposited, IndexKind::tree),
                                  PhotonMap(deposited, IndexKind::flann)};
        Sampler sampler(3, Purpose::test, 0, n);
        for (int query = 0; query < 30; ++query) {
            const Search search = make_search(maps[0], scale, MetricKind::euclidean, sampler);
            std::vector<Neighbour> by_index;
            for (std::uint32_t i = 0; i < maps[0].size(); ++i) {
                const float r2 = (maps[0].positions()[i] - search.x).length2();
                if (r2 < search.most2) by_index.push_back({i, r2});
            }
            found += !by_index.empty();
            std::vector<Neighbour> by_distance = by_index;
            std::sort(by_distance.begin(), by_distance.end());
            for (const PhotonMap& map : maps) {
                std::vector<Neighbour> within;
                map.index().within_in_space(search.x, search.most2, within);
                expect_equal(within, by_index);
                for (const std::size_t k : {std::size_t{1}, std::size_t{20}, n + 5}) {
                    Nearest nearest(k, search.most2);
                    map.index().nearest_in_space(search.x, nearest);
                    expect_equal(nearest.sorted(),
                                 std::span(by_distance).first(std::min(k, by_distance.size())));
                }
            }
        }
    }
    EXPECT_GT(found, 20);
}

INSTANTIATE_TEST_SUITE_P(All, PhotonIndexClouds,
                         ::testing::Combine(::testing::ValuesIn(kClouds),
                                            ::testing::Values(1.0F, 1e-6F, 1e6F),
                                            ::testing::Values(MetricKind::projected, MetricKind::euclidean)));
INSTANTIATE_TEST_SUITE_P(All, PhotonIndexInSpace,
                         ::testing::Combine(::testing::ValuesIn(kClouds),
                                            ::testing::Values(1.0F, 1e-6F, 1e6F)));

// Returns a node of eight equal boxes.
BoxNode8 node_of(const V3f& low, const V3f& high) {
    BoxNode8 node;
    node.low_x.fill(low.x), node.low_y.fill(low.y), node.low_z.fill(low.z);
    node.high_x.fill(high.x), node.high_y.fill(high.y), node.high_z.fill(high.z);
    return node;
}

// Too large a bound would lose photons: every photon in a box must be at least as far away as the bound.
TEST(TangentMetric, BoundOfABox_NeverAboveAPhotonInIt) {
    Sampler sampler(4, Purpose::test, 0, 0);
    int useful = 0;
    for (int i = 0; i < 20'000; ++i) {
        // Boxes from flat to thick, from near the plane to far above it.
        const float thin = std::pow(10.0F, -6 * sampler.next());
        const V3f low =
            V3f(sampler.next(), sampler.next(), thin * sampler.next()) * 4.0F - V3f(2, 2, 2 * thin);
        const V3f size = V3f(sampler.next(), sampler.next(), thin * sampler.next());
        const BoxNode8 node = node_of(low, low + size);
        V3f n = square_to_sphere(sampler.next2());
        if (sampler.next() < 0.7F) n = V3f(0, 0, 1);
        const TangentMetric metric(V3f(0), n, MetricKind::projected, 1 + 3 * sampler.next());
        const float bound = metric.bounds(node)[0];
        useful += metric.ball2(bound) > box_distances2(node, V3f(0))[0] * 1.01F;
        for (int j = 0; j < 20; ++j) {
            V3f p = low + size * V3f(sampler.next(), sampler.next(), sampler.next());
            for (unsigned c = 0; c < 3; ++c) p[c] = std::min(p[c], low[c] + size[c]);
            V3f d = square_to_sphere(sampler.next2());
            if (j % 2 == 0) d = V3f(d.x, d.y, 0.01F * d.z).normalized();
            EXPECT_LE(bound, metric(p, d, p.length2()));
        }
    }
    EXPECT_GT(useful, 1000) << "no bound was better than that of the ball";
}

// Boxes of directions tighten the bound: they may exclude a node only if no direction in them counts, not
// even one along the surface that is on the right side by rounding.
TEST(TangentMetric, BoundOfABeam_NeverAboveAPhotonInItAndInfiniteFromBehind) {
    Sampler sampler(6, Purpose::test, 0, 0);
    int kept_out = 0, slid_far = 0;
    for (int i = 0; i < 20'000; ++i) {
        const V3f n = square_to_sphere(sampler.next2());
        const TangentMetric metric(V3f(0), n, MetricKind::projected, 2);
        const float wide = std::pow(10.0F, -8 * sampler.next());
        V3f middle = square_to_sphere(sampler.next2());
        if (i % 2 == 0) middle = (middle - n.dot(middle) * n).normalized();  // along the surface
        std::array<V3f, 8> directions;
        Box3f box;
        for (V3f& d : directions) {
            const PackedDirection packed((middle + wide * square_to_sphere(sampler.next2())).normalized());
            d = PackedDirection::along(packed.bits());
            box.extendBy(d);
        }
        const V3f low = V3f(sampler.next(), sampler.next(), sampler.next()) * 2.0F - V3f(1);
        const V3f size = V3f(sampler.next(), sampler.next(), sampler.next()) * 0.3F * sampler.next();
        const BoxNode8 places = node_of(low, low + size);
        const float bound = metric.bounds(places, node_of(box.min, box.max))[0];
        kept_out += bound == INFINITY;
        slid_far += bound < INFINITY && bound > 1.1F * metric.bounds(places)[0];
        for (const V3f& d : directions) {
            V3f at = low + size * V3f(sampler.next(), sampler.next(), sampler.next());
            for (unsigned c = 0; c < 3; ++c) at[c] = std::min(at[c], low[c] + size[c]);
            EXPECT_LE(bound, metric(at, d, at.length2()));
        }
    }
    EXPECT_GT(kept_out, 4000) << "of some 10,000 that come from behind or along";
    EXPECT_GT(slid_far, 1000) << "directions told no more than the place";
}

// A caustic on a table's top, of light that comes from two places above it, and points on the table's front.
// The photons' paths cross the plane of the front, but above the top.
TEST(TangentMetric, CausticBeyondAnEdge_FewOfItsPhotonsAreLookedAt) {
    constexpr std::size_t kPhotons = 100'000;
    Sampler sampler(8, Purpose::test, 0, 0);
    Photons deposited;
    for (std::size_t i = 0; i < kPhotons; ++i) {
        const V3f p(sampler.next(), sampler.next(), 0);
        const V3f from =
            V3f(i % 2 == 0 ? 0.4F : 0.6F, 0.2F, 0.3F) + 0.05F * square_to_sphere(sampler.next2());
        deposited.add(p, PackedDirection(V3f(0, 0, 1)),
                      {PackedDirection((p - from).normalized()), Rgb(1), 0, kNoCell});
    }
    const PhotonMap map(deposited);
    std::vector<std::uint32_t> directions;
    for (const Photon& photon : map.photons()) directions.push_back(photon.direction.bits());
    const BoxTree tree = build_box_tree(map.positions(), directions, Workers{2}, PackedDirection::along);
    std::size_t looked_at = 0;
    constexpr std::size_t kSearches = 100;
    for (std::size_t i = 0; i < kSearches; ++i) {
        const V3f x(sampler.next(), 0, -0.3F * sampler.next());
        const TangentMetric metric(x, V3f(0, -1, 0), MetricKind::projected, 2);
        Nearest found(51, 0.1F);
        search_nearest(tree, metric, found.bound(), [&](const BlockKeys& keys, std::uint32_t first) {
            ++looked_at;
            return found.take(keys, first);
        });
    }
    EXPECT_LT(looked_at * kBlock, kPhotons / 25 * kSearches);
}

TEST(PackedDirection, AlongTheOctahedron_SameDirectionAsUnpacked) {
    Sampler sampler(5, Purpose::test, 0, 0);
    for (int i = 0; i < 100'000; ++i) {
        const PackedDirection packed(square_to_sphere(sampler.next2()));
        const V3f along = PackedDirection::along(packed.bits());
        EXPECT_NEAR(std::fabs(along.x) + std::fabs(along.y) + std::fabs(along.z), 1, 1e-6F);
        EXPECT_LT((along.normalized() - packed.unpack()).length(), 1e-6F);
    }
}

TEST(PhotonMap, MadeOfAnothersPhotons_SameOrder) {
    const PhotonMap first(make_photons(Cloud::grid, 5000, 1));
    Photons copy;
    for (std::size_t i = 0; i < first.size(); ++i) {
        copy.add(first.positions()[i], first.normals()[i], first.photons()[i]);
    }
    const PhotonMap second(copy, IndexKind::flann, Workers{3});
    for (std::size_t i = 0; i < first.size(); ++i) {
        ASSERT_EQ(first.positions()[i], second.positions()[i]);
        ASSERT_EQ(first.photons()[i].direction.bits(), second.photons()[i].direction.bits());
    }
}

}  // namespace photon_index_test
}  // namespace lucerna
