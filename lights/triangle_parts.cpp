#include "lights/triangle_parts.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace lucerna {
namespace {

// A compact piece has all normals within 4 degrees of their mean, and fills at least this share of the
// rectangle around it.
constexpr double kSameNormal = 0.9976, kFilled = 0.55;

class Splitting {
  public:
    Splitting(std::span<const V3f> p, std::span<const V3i> triangles) : p_(p), triangles_(triangles) {
        order_.resize(triangles.size());
        std::iota(order_.begin(), order_.end(), 0U);
    }

    std::vector<std::uint32_t> parts(std::size_t most) {
        parts_.resize(triangles_.size());
        if (!triangles_.empty()) split(0, triangles_.size(), most);
        return std::move(parts_);
    }

  private:
    V3d corner(std::uint32_t triangle, int c) const {
        return V3d(p_[static_cast<std::size_t>(triangles_[triangle][c])]);
    }
    // Returns a normal whose length is twice the area.
    V3d across(std::uint32_t triangle) const {
        const V3d p0 = corner(triangle, 0);
        return (corner(triangle, 1) - p0).cross(corner(triangle, 2) - p0);
    }
    V3d middle(std::uint32_t triangle) const {
        return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
    }

    void split(std::size_t begin, std::size_t end, std::size_t most) {
        const std::span<std::uint32_t> range(&order_[begin], end - begin);
        if (range.size() == 1 || most == 1 || is_compact(range)) {
            for (const std::uint32_t triangle : range) parts_[triangle] = count_;
            ++count_;
            return;
        }
        Imath::Box3d box;
        for (const std::uint32_t triangle : range) box.extendBy(middle(triangle));
        const auto axis = static_cast<int>(box.majorAxis());
        // Halving the number of triangles bounds the depth: 2^32 triangles need 32 levels.
        const std::size_t half = range.size() / 2;
        std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half), range.end(),
                         [&](std::uint32_t a, std::uint32_t b) {
                             const double x = middle(a)[axis], y = middle(b)[axis];
                             return x < y || (x == y && a < b);
                         });
        // Each half is sorted, so that sums over it do not depend on the library's selection.
        std::sort(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(half));
        std::sort(range.begin() + static_cast<std::ptrdiff_t>(half), range.end());
        split(begin, begin + half, most - most / 2);
        split(begin + half, end, most / 2);
    }

    bool is_compact(std::span<const std::uint32_t> range) const {
        V3d normal(0);
        double area = 0, longest = 0;
        V3d along(1, 0, 0);
        for (const std::uint32_t triangle : range) {
            const V3d twice = across(triangle);
            normal += twice;
            area += 0.5 * twice.length();
            for (int c = 0; c < 3; ++c) {
                const V3d side = corner(triangle, (c + 1) % 3) - corner(triangle, c);
                // Sides with a right angle at one end are the rectangle's own, not its diagonals.
                if (side.length2() > longest && is_right_angled(triangle, c)) {
                    longest = side.length2();
                    along = side;
                }
            }
        }
        const double length = normal.length();
        if (!(length > 0) || !std::isfinite(length)) return false;
        const V3d n = normal / length;
        if (longest == 0) along = corner(range[0], 1) - corner(range[0], 0);
        V3d s = along - n * n.dot(along);
        if (!(s.length2() > 0)) return false;
        s.normalize();
        const V3d t = n.cross(s);
        Imath::Box3d box;
        for (const std::uint32_t triangle : range) {
            const V3d twice = across(triangle);
            if (!(twice.dot(n) >= kSameNormal * twice.length())) return false;
            for (int c = 0; c < 3; ++c) {
                const V3d q = corner(triangle, c);
                box.extendBy(V3d(q.dot(s), q.dot(t), q.dot(n)));
            }
        }
        const V3d size = box.size();
        // Pieces behind one another fill it more than once but are not flat.
        return area >= kFilled * size.x * size.y && size.z * size.z <= 0.01 * area;
    }

    // Returns true if there is a right angle at one end of side c.
    bool is_right_angled(std::uint32_t triangle, int c) const {
        const V3d a = corner(triangle, c), b = corner(triangle, (c + 1) % 3),
                  o = corner(triangle, (c + 2) % 3);
        const V3d side = b - a;
        const auto right = [&](const V3d& other) {
            return std::fabs(other.dot(side)) <= 0.02 * other.length() * side.length();
        };
        return right(o - a) || right(o - b);
    }

    std::span<const V3f> p_;
    std::span<const V3i> triangles_;
    std::vector<std::uint32_t> order_, parts_;
    std::uint32_t count_ = 0;
};

}  // namespace

std::vector<std::uint32_t> parts_of_triangles(std::span<const V3f> p, std::span<const V3i> triangles,
                                              std::size_t most) {
    assert(most >= 1);
    return Splitting(p, triangles).parts(most);
}

}  // namespace lucerna
