// Every index against brute force.
#include "kdtree/point_tree.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "engine/base/stream.h"
#include "kdtree/nearest_heap.h"

namespace lucerna {
namespace {

class All final : public PointVisitor {
  public:
    explicit All(float r2) : r2_(r2) {}
    float visit(std::uint32_t index, float) override {
        found.push_back(index);
        return r2_;
    }
    std::vector<std::uint32_t> found;

  private:
    float r2_;
};

class Nearest final : public PointVisitor {
  public:
    explicit Nearest(std::size_t k) : heap(k) {}
    float visit(std::uint32_t index, float r2) override {
        heap.offer(r2, index);
        // One unit beyond the worst, so that a tie at the boundary is still seen and decided by index.
        return std::nextafter(heap.worst(), INFINITY);
    }
    NearestHeap heap;
};

enum class Cloud { random, line, plane, coincident, two_clusters };

std::vector<V3f> make_cloud(Cloud kind, std::size_t n, float scale) {
    Stream stream(7, Purpose::test, static_cast<std::uint32_t>(kind), n);
    std::vector<V3f> points(n);
    for (V3f& p : points) {
        p = V3f(stream.next(), stream.next(), stream.next());
        if (kind == Cloud::line) p.y = p.z = 0.5F;
        if (kind == Cloud::plane) p.z = 0.25F;
        if (kind == Cloud::coincident) p = V3f(0.5F);
        if (kind == Cloud::two_clusters) p = p * 1e-3F + V3f(stream.next() < 0.5F ? 0.0F : 1.0F);
        p *= scale;
    }
    return points;
}

std::vector<std::uint32_t> ball(const PointTree& tree, const V3f& x, float r2) {
    All all(r2);
    tree.visit_ball(x, r2, all);
    std::sort(all.found.begin(), all.found.end());
    return all.found;
}

std::vector<std::uint32_t> nearest(const PointTree& tree, const V3f& x, std::size_t k) {
    Nearest visitor(k);
    tree.visit_ball(x, INFINITY, visitor);
    std::vector<std::uint32_t> indices;
    for (const Neighbour& n : visitor.heap.sorted()) indices.push_back(n.index);
    return indices;
}

class PointTreeClouds : public ::testing::TestWithParam<std::tuple<Cloud, float>> {};

TEST_P(PointTreeClouds, Flann_BallAndNearest_EqualBruteForce) {
    const auto [kind, scale] = GetParam();
    for (const std::size_t n : {1U, 2U, 13U, 500U, 3000U}) {
        const std::vector<V3f> points = make_cloud(kind, n, scale);
        const auto tree = make_flann_tree(points);
        const auto oracle = make_brute_force(points);
        Stream stream(8, Purpose::test, 0, n);
        for (int query = 0; query < 20; ++query) {
            const V3f x = V3f(stream.next(), stream.next(), stream.next()) * scale;
            const float r2 = sqr(stream.next() * 0.5F * scale);
            ASSERT_EQ(ball(*tree, x, r2), ball(*oracle, x, r2));
            for (const std::size_t k : {std::size_t{1}, std::size_t{10}, std::size_t{300}, n + 5}) {
                ASSERT_EQ(nearest(*tree, x, k), nearest(*oracle, x, k)) << "n " << n << " k " << k;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, PointTreeClouds,
                         ::testing::Combine(::testing::Values(Cloud::random, Cloud::line, Cloud::plane,
                                                              Cloud::coincident, Cloud::two_clusters),
                                            ::testing::Values(1.0F, 1e-6F, 1e6F)));

TEST(PointTree, Flann_NoPoints_VisitsNothing) {
    const auto tree = make_flann_tree({});
    EXPECT_EQ(tree->size(), 0U);
    EXPECT_TRUE(ball(*tree, V3f(0.0F), 1.0F).empty());
}

RC_GTEST_PROP(NearestHeap, AnyOrderOfOffers_SameResult, (std::vector<std::uint8_t> keys)) {
    // Bytes as keys make many ties.
    RC_PRE(!keys.empty());
    const std::size_t k = 1 + keys.size() / 2;
    NearestHeap forward(k);
    NearestHeap backward(k);
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < keys.size(); ++i) {
        all.push_back({static_cast<float>(keys[i]), i});
        forward.offer(all[i].key, i);
    }
    for (std::size_t i = keys.size(); i-- > 0;) backward.offer(all[i].key, static_cast<std::uint32_t>(i));
    std::sort(all.begin(), all.end());
    const auto a = forward.sorted();
    const auto b = backward.sorted();
    RC_ASSERT(a.size() == std::min(k, keys.size()));
    for (std::size_t i = 0; i < a.size(); ++i) {
        RC_ASSERT(a[i].index == all[i].index);
        RC_ASSERT(b[i].index == all[i].index);
    }
}

}  // namespace
}  // namespace lucerna
