// Visits points within a ball, by FLANN's tree or by testing every point.
#include "kdtree/point_tree.h"

#include <flann/flann.hpp>

namespace lucerna {

// Tests every point, to verify the trees.

namespace {

class BruteForce final : public PointTree {
  public:
    explicit BruteForce(std::span<const V3f> points) : points_(points) {}

    void visit_ball(const V3f& x, float r2, PointVisitor& visitor) const override {
        for (std::uint32_t i = 0; i < points_.size(); ++i) {
            const float d2 = (points_[i] - x).length2();
            if (d2 < r2) r2 = std::min(r2, visitor.visit(i, d2));
        }
    }
    std::size_t size() const override { return points_.size(); }

  private:
    std::span<const V3f> points_;
};

}  // namespace

std::unique_ptr<PointTree> make_brute_force(std::span<const V3f> points) {
    return std::make_unique<BruteForce>(points);
}

// FLANN's exact kd-tree behind our interface. No other file includes FLANN.
//
// FLANN reports every candidate to a result set as it finds it and asks the set for the bound. Our set passes
// both to the visitor, so that filtering happens during the search. FLANN allocates one small vector per
// query.

namespace {

class VisitorSet final : public flann::ResultSet<float> {
  public:
    VisitorSet(float r2, PointVisitor& visitor) : r2_(r2), visitor_(visitor) {}

    bool full() const override { return true; }
    // Returns slightly more than the ball's radius: FLANN sums the distances to its cells in rounded steps,
    // and would miss points that lie on the bound.
    float worstDist() const override { return r2_ * (1 + kRounding); }
    void addPoint(float r2, std::size_t index) override {
        if (r2 < r2_) r2_ = std::min(r2_, visitor_.visit(static_cast<std::uint32_t>(index), r2));
    }

  private:
    static constexpr float kRounding = 1.0F / (1 << 15);  // of some hundred steps
    float r2_;
    PointVisitor& visitor_;
};

class FlannTree final : public PointTree {
  public:
    explicit FlannTree(std::span<const V3f> points)
        // FLANN takes a mutable pointer, but with reordering into its own copy it never writes through it.
        : index_(flann::Matrix<float>(const_cast<float*>(&points.front().x), points.size(), 3),
                 flann::KDTreeSingleIndexParams(kLeafSize, true)),
          size_(points.size()) {
        index_.buildIndex();
    }

    void visit_ball(const V3f& x, float r2, PointVisitor& visitor) const override {
        VisitorSet results(r2, visitor);
        index_.findNeighbors(results, &x.x, flann::SearchParams());
    }
    std::size_t size() const override { return size_; }

  private:
    static constexpr int kLeafSize = 12;
    flann::KDTreeSingleIndex<flann::L2_3D<float>> index_;
    std::size_t size_;
};

}  // namespace

std::unique_ptr<PointTree> make_flann_tree(std::span<const V3f> points) {
    // FLANN cannot index an empty set; the brute force over no points is the empty tree.
    if (points.empty()) return make_brute_force(points);
    static_assert(sizeof(V3f) == 3 * sizeof(float));
    return std::make_unique<FlannTree>(points);
}

}  // namespace lucerna
