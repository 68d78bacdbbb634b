// Looks at every point: the oracle of the trees.
#include "kdtree/point_tree.h"

namespace lucerna {
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

}  // namespace lucerna
