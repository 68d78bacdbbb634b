// Closed forms that renders must agree with, each derived beside its function.
#pragma once

#include <cmath>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna::testing {

// Returns the part of a convex polygon above the plane through x with normal n (Sutherland and Hodgman).
inline std::vector<V3d> above(const std::vector<V3d>& corners, const V3d& x, const V3d& n) {
    std::vector<V3d> kept;
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const V3d &a = corners[i], &b = corners[(i + 1) % corners.size()];
        const double h_a = n.dot(a - x), h_b = n.dot(b - x);
        if (h_a >= 0) kept.push_back(a);
        if ((h_a > 0 && h_b < 0) || (h_a < 0 && h_b > 0)) kept.push_back(a + (h_a / (h_a - h_b)) * (b - a));
    }
    return kept;
}

// Returns the irradiance at x with normal n from a convex polygon of radiance 1, by Lambert's contour
// integral.
inline double contour_irradiance(const std::vector<V3d>& corners, const V3d& x, const V3d& n) {
    const std::vector<V3d> seen = above(corners, x, n);
    double sum = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const V3d a = (seen[i] - x).normalized(), b = (seen[(i + 1) % seen.size()] - x).normalized();
        const V3d axis = a.cross(b);
        if (!(axis.length() > 0)) continue;  // corners in line with x
        sum += std::atan2(axis.length(), a.dot(b)) * axis.normalized().dot(n);
    }
    return std::fabs(sum) / 2;
}

}  // namespace lucerna::testing
