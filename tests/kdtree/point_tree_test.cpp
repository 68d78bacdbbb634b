// Tests the FLANN index against brute force.
#include "kdtree/point_tree.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/sampler.h"
#include "kdtree/nearest.h"
#include "tests/kdtree/clouds.h"

namespace lucerna {
namespace point_tree_test {

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

class NearestVisitor final : public PointVisitor {
  public:
    explicit NearestVisitor(std::size_t k) : nearest(k, INFINITY) {}
    float visit(std::uint32_t index, float r2) override {
        // One unit in the last place beyond the worst, so that a tie at the boundary is still visited and
        // decided by index.
        return std::nextafter(nearest.take(r2, index), INFINITY);
    }
    Nearest nearest;
};

std::vector<std::uint32_t> ball(const PointTree& tree, const V3f& x, float r2) {
    All all(r2);
    tree.visit_ball(x, r2, all);
    std::sort(all.found.begin(), all.found.end());
    return all.found;
}

std::vector<std::uint32_t> nearest(const PointTree& tree, const V3f& x, std::size_t k) {
    NearestVisitor visitor(k);
    tree.visit_ball(x, INFINITY, visitor);
    std::vector<std::uint32_t> indices;
    for (const Neighbour& n : visitor.nearest.sorted()) indices.push_back(n.index);
    return indices;
}

class PointTreeClouds : public ::testing::TestWithParam<std::tuple<Cloud, float>> {};

TEST_P(PointTreeClouds, Flann_BallAndNearest_EqualBruteForce) {
    const auto [kind, scale] = GetParam();
    for (const std::size_t n : {1U, 2U, 13U, 500U, 3000U}) {
        const std::vector<V3f> points = make_cloud(kind, n, scale);
        const auto tree = make_flann_tree(points);
        const auto oracle = make_brute_force(points);
        Sampler sampler(8, Purpose::test, 0, n);
        for (int query = 0; query < 20; ++query) {
            const V3f x = V3f(sampler.next(), sampler.next(), sampler.next()) * scale;
            const float r2 = sqr(sampler.next() * 0.5F * scale);
            ASSERT_EQ(ball(*tree, x, r2), ball(*oracle, x, r2));
            for (const std::size_t k : {std::size_t{1}, std::size_t{10}, std::size_t{300}, n + 5}) {
                ASSERT_EQ(nearest(*tree, x, k), nearest(*oracle, x, k)) << "n " << n << " k " << k;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, PointTreeClouds,
                         ::testing::Combine(::testing::ValuesIn(kClouds),
                                            ::testing::Values(1.0F, 1e-6F, 1e6F)));

TEST(PointTree, Flann_NoPoints_VisitsNothing) {
    const auto tree = make_flann_tree({});
    EXPECT_EQ(tree->size(), 0U);
    EXPECT_TRUE(ball(*tree, V3f(0.0F), 1.0F).empty());
}

}  // namespace point_tree_test
}  // namespace lucerna
