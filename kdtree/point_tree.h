// Points in space and the one question asked of them: which lie near x?
//
// Knows nothing of light. A tree indexes a span it does not own and never changes; queries are const, safe
// from any thread. The visitor sees each point inside the ball once, in no promised order, and may shrink the
// ball as it learns: so one query serves the k nearest by any distance that the Euclidean one bounds, and all
// within a radius.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

class PointVisitor {
  public:
    virtual ~PointVisitor() = default;
    // A point at squared Euclidean distance r2. Returns the squared radius that still matters (never larger
    // than what it returned before); points beyond it need not be visited, but may be.
    virtual float visit(std::uint32_t index, float r2) = 0;
};

class PointTree {
  public:
    virtual ~PointTree() = default;

    // Visits the points with squared distance to x below r2 (r2 > 0, may be infinite).
    virtual void visit_ball(const V3f& x, float r2, PointVisitor& visitor) const = 0;
    virtual std::size_t size() const = 0;
};

// `points` are finite and must outlive the tree. Empty is allowed.
std::unique_ptr<PointTree> make_flann_tree(std::span<const V3f> points);
// Looks at every point: the oracle.
std::unique_ptr<PointTree> make_brute_force(std::span<const V3f> points);

}  // namespace lucerna
