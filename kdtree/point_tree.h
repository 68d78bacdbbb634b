// Spatial search: which points lie near x?
//
// This code knows nothing of light. A tree indexes a span that it does not own and never changes; queries are
// const and thread-safe. The visitor sees each point inside the ball once, in no particular order, and may
// shrink the ball meanwhile. One query thus serves the k nearest by any distance that the Euclidean one
// bounds, and all points within a radius.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "engine/base/vec.h"

namespace lucerna {

class PointVisitor {
  public:
    virtual ~PointVisitor() = default;
    // Visits a point at squared Euclidean distance r2. Returns the squared radius that still matters, which
    // never grows; points beyond it need not be visited, but may be.
    virtual float visit(std::uint32_t index, float r2) = 0;
};

class PointTree {
  public:
    virtual ~PointTree() = default;

    // Visits the points with squared distance to x below r2 (r2 > 0, may be infinite).
    virtual void visit_ball(const V3f& x, float r2, PointVisitor& visitor) const = 0;
    virtual std::size_t size() const = 0;
};

// Requires finite `points` that outlive the tree. There may be none.
std::unique_ptr<PointTree> make_flann_tree(std::span<const V3f> points);
// Tests every point; used to verify the trees.
std::unique_ptr<PointTree> make_brute_force(std::span<const V3f> points);

}  // namespace lucerna
