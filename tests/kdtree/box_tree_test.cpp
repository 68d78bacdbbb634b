// Tests the tree of boxes against a search of all points, and the properties of its order.
#include "kdtree/box_tree.h"

#include <gtest/gtest.h>

#include <numeric>

#include "kdtree/nearest.h"
#include "tests/kdtree/clouds.h"

namespace lucerna {
namespace box_tree_test {

// Measures Euclidean distance, of the points whose payload is even.
struct EvenMeasure {
    V3f x;

    static float key(const V3f& v, std::uint32_t payload) {
        return payload % 2 == 0 ? v.length2() : INFINITY;
    }
    BlockKeys keys(const PointBlock& block) const {
        BlockKeys keys;
        for (std::size_t i = 0; i < kBlock; ++i) {
            keys[i] = key(V3f(block.x[i], block.y[i], block.z[i]) - x, block.payload[i]);
        }
        return keys;
    }
    Node8Keys bounds(const BoxNode8& node) const { return box_distances2(node, x); }
};

struct WithPayload {
    std::vector<V3f> points;
    std::vector<std::uint32_t> payloads;
};

// Returns the points in the tree's order; the payloads are their former indices.
WithPayload ordered(const std::vector<V3f>& points, int threads = 2) {
    WithPayload result;
    result.payloads = box_order(points, Workers{threads});
    for (const std::uint32_t old : result.payloads) result.points.push_back(points[old]);
    return result;
}

std::vector<Neighbour> visit_all(const WithPayload& cloud, const V3f& x, float most) {
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < cloud.points.size(); ++i) {
        const float key = EvenMeasure::key(cloud.points[i] - x, cloud.payloads[i]);
        if (key < most) all.push_back({i, key});
    }
    std::sort(all.begin(), all.end());
    return all;
}

void expect_equal(std::span<const Neighbour> found, std::span<const Neighbour> expected) {
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i].rank(), expected[i].rank()) << i;
}

class BoxTreeClouds : public ::testing::TestWithParam<std::tuple<Cloud, float, bool>> {};

TEST_P(BoxTreeClouds, NearestAndWithin_EqualALookAtEveryPoint) {
    const auto [kind, scale, in_order] = GetParam();
    for (const std::size_t n : {0U, 1U, 2U, 15U, 16U, 17U, 128U, 129U, 2000U}) {
        WithPayload cloud = ordered(make_cloud(kind, n, scale));
        if (!in_order) {
            // The tree is correct for any order, only slower.
            std::sort(cloud.points.begin(), cloud.points.end(),
                      [](const V3f& a, const V3f& b) { return std::fmod(a.x, 0.1F) < std::fmod(b.x, 0.1F); });
        }
        const BoxTree tree = build_box_tree(cloud.points, cloud.payloads, Workers{2});
        EXPECT_EQ(tree.size, n);
        Sampler sampler(8, Purpose::test, 0, n);
        for (int query = 0; query < 20; ++query) {
            const EvenMeasure measure{place_near(cloud.points, scale, sampler)};
            const float most = query % 4 == 0 ? INFINITY : sqr((0.01F + sampler.next()) * scale);
            std::vector<Neighbour> expected = visit_all(cloud, measure.x, most);

            std::vector<Neighbour> within;
            search_all(tree, measure, just_below(most), [&](const BlockKeys& keys, std::uint32_t first) {
                for (std::uint32_t i = 0; i < kBlock; ++i) {
                    if (keys[i] < most) within.push_back({first + i, keys[i]});
                }
            });
            EXPECT_TRUE(std::is_sorted(within.begin(), within.end(), [](const auto& a, const auto& b) {
                return a.index < b.index;
            })) << "the blocks come in their order";
            std::sort(within.begin(), within.end());
            expect_equal(within, expected);

            for (const std::size_t k : {std::size_t{1}, std::size_t{7}, std::size_t{60}, n + 5}) {
                Nearest nearest(k, most);
                search_nearest(
                    tree, measure, nearest.bound(),
                    [&](const BlockKeys& keys, std::uint32_t first) { return nearest.take(keys, first); });
                expect_equal(nearest.sorted(), std::span(expected).first(std::min(k, expected.size())));
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, BoxTreeClouds,
                         ::testing::Combine(::testing::ValuesIn(kClouds),
                                            ::testing::Values(1.0F, 1e-6F, 1e6F), ::testing::Bool()));

// Measures Euclidean distance, of the points whose payload is at least `least`; payloads are represented by
// places on the x axis.
struct LaterMeasure {
    V3f x;
    std::uint32_t least;

    BlockKeys keys(const PointBlock& block) const {
        BlockKeys keys;
        for (std::size_t i = 0; i < kBlock; ++i) {
            const float d2 = (V3f(block.x[i], block.y[i], block.z[i]) - x).length2();
            keys[i] = block.payload[i] >= least ? d2 : INFINITY;
        }
        return keys;
    }
    Node8Keys bounds(const BoxNode8& node) const { return box_distances2(node, x); }
    Node8Keys bounds(const BoxNode8& node, const BoxNode8& payloads) const {
        Node8Keys all = bounds(node);
        for (std::size_t i = 0; i < kNodeWidth; ++i) {
            if (payloads.high_x[i] < static_cast<float>(least)) all[i] = INFINITY;
        }
        return all;
    }
};

TEST(BoxTreePayloads, WhatTheyStandFor_KeepsWholeNodesOut) {
    for (const std::uint32_t n : {1U, 16U, 129U, 1024U, 1025U, 30'000U}) {
        WithPayload cloud = ordered(make_cloud(kClouds[0], n, 1));
        std::iota(cloud.payloads.begin(), cloud.payloads.end(),
                  0U);  // neighbours in space have similar payloads
        const auto place = [](std::uint32_t payload) { return V3f(static_cast<float>(payload), 0, 0); };
        const BoxTree tree = build_box_tree(cloud.points, cloud.payloads, Workers{2}, place);
        const LaterMeasure measure{cloud.points[0], n / 4 * 3};
        std::uint32_t before = 0, counted = 0;
        const auto look = [&](const BlockKeys& keys, std::uint32_t first) {
            for (const float key : keys) counted += static_cast<std::uint32_t>(key < INFINITY);
            before += static_cast<std::uint32_t>(first + kNodeWidth * kBlock < measure.least);
            return just_below(INFINITY);
        };
        search_nearest(tree, measure, just_below(INFINITY), look);
        EXPECT_EQ(counted, n - measure.least);
        search_all(tree, measure, just_below(INFINITY), look);
        EXPECT_EQ(counted, 2 * (n - measure.least));
        // Boxes of payloads belong to boxes of whole nodes, so there must be two levels.
        if (n > kNodeWidth * kBlock) {
            EXPECT_EQ(before, 0U) << n;
        }
    }
}

class BoxOrder : public ::testing::TestWithParam<Cloud> {};

TEST_P(BoxOrder, AnyCloud_EveryPointOnce_SameForAnyThreads_AndSettled) {
    for (const std::size_t n : {0U, 1U, 16U, 17U, 1000U, 20'000U}) {
        const std::vector<V3f> points = make_cloud(GetParam(), n, 1);
        const std::vector<std::uint32_t> order = box_order(points, Workers{1});
        std::vector<std::uint32_t> sorted = order;
        std::sort(sorted.begin(), sorted.end());
        std::vector<std::uint32_t> each(n);
        std::iota(each.begin(), each.end(), 0U);
        EXPECT_EQ(sorted, each);
        for (const int threads : {2, 5}) EXPECT_EQ(box_order(points, Workers{threads}), order);
        // Ordering again moves nothing, so that a saved and loaded map is the same map.
        EXPECT_EQ(box_order(ordered(points).points, Workers{2}), each);
    }
}

INSTANTIATE_TEST_SUITE_P(All, BoxOrder, ::testing::ValuesIn(kClouds));

// The walls of a cube are equally long except for rounding, which differs by scale.
TEST(BoxOrder, WallsOfACube_AreInTheSameOrderAtAnyScale) {
    constexpr std::size_t kPoints = 20'000;
    const auto cube = [](float scale) {
        Sampler sampler(11, Purpose::test, 0, 0);
        std::vector<V3f> points(kPoints);
        for (V3f& p : points) {
            p = V3f(sampler.next(), sampler.next(), sampler.next());
            const auto wall = static_cast<int>(6 * sampler.next());
            p[wall / 2] = static_cast<float>(wall % 2);
            p = (p + V3f(0.1F, 0.7F, 0.2F)) * scale;
        }
        return box_order(points, Workers{2});
    };
    const std::vector<std::uint32_t> order = cube(1);
    for (const float scale : {1e-6F, 0.3F, 7.0F, 1e6F}) {
        const std::vector<std::uint32_t> other = cube(scale);
        std::size_t same = 0;
        for (std::size_t i = 0; i < kPoints; ++i) same += order[i] == other[i];
        EXPECT_GT(same, kPoints * 99 / 100) << scale;
    }
}

// Returns the mean number of blocks visited by a search for the 50 nearest points.
double blocks_per_search(const WithPayload& cloud) {
    const BoxTree tree =
        build_box_tree(cloud.points, std::vector<std::uint32_t>(cloud.points.size()), Workers{2});
    Sampler sampler(9, Purpose::test, 0, 0);
    int blocks = 0;
    constexpr int kSearches = 200;
    for (int i = 0; i < kSearches; ++i) {
        const EvenMeasure measure{place_near(cloud.points, 1, sampler)};
        Nearest nearest(50, INFINITY);
        search_nearest(tree, measure, nearest.bound(), [&](const BlockKeys& keys, std::uint32_t first) {
            ++blocks;
            return nearest.take(keys, first);
        });
    }
    return static_cast<double>(blocks) / kSearches;
}

TEST(BoxOrder, PointsOnASurface_FewBlocksAreLookedAt) {
    const std::vector<V3f> points = make_cloud(Cloud::plane, 100'000, 1);
    EXPECT_LT(blocks_per_search(ordered(points)), 16);  // 50 points fill 3.1 blocks, and a disc has an edge
    EXPECT_GT(blocks_per_search({points, std::vector<std::uint32_t>(points.size())}), 1000) << "no order";
}

}  // namespace box_tree_test
}  // namespace lucerna
