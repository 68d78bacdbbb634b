// Point clouds for tests of trees: uniform ones, flat ones, and ones with many ties.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/vec.h"

namespace lucerna {

enum class Cloud { random, line, plane, tilted_plane, coincident, two_clusters, grid, far_off };

inline constexpr Cloud kClouds[] = {Cloud::random,     Cloud::line,         Cloud::plane, Cloud::tilted_plane,
                                    Cloud::coincident, Cloud::two_clusters, Cloud::grid,  Cloud::far_off};

// Returns n points in a cube from 0 to `scale`, or near it.
inline std::vector<V3f> make_cloud(Cloud kind, std::size_t n, float scale) {
    Sampler sampler(7, Purpose::test, static_cast<std::uint32_t>(kind), n);
    std::vector<V3f> points(n);
    for (V3f& p : points) {
        p = V3f(sampler.next(), sampler.next(), sampler.next());
        if (kind == Cloud::line) p.y = p.z = 0.5F;
        if (kind == Cloud::plane) p.z = 0.25F;
        if (kind == Cloud::tilted_plane) p.z = 0.3F * p.x + 0.4F * p.y;
        if (kind == Cloud::coincident) p = V3f(0.5F);
        if (kind == Cloud::two_clusters) p = p * 1e-3F + V3f(sampler.next() < 0.5F ? 0.0F : 1.0F);
        if (kind == Cloud::grid) p = V3f(std::floor(p.x * 9), std::floor(p.y * 9), std::floor(p.z * 9)) / 8;
        if (kind == Cloud::far_off) p += V3f(1e4F, -1e4F, 1e4F);
        p *= scale;
    }
    return points;
}

// Returns a query point: in the cube, or one of the points themselves.
inline V3f place_near(const std::vector<V3f>& points, float scale, Sampler& sampler) {
    const V3f x = V3f(sampler.next(), sampler.next(), sampler.next()) * scale;
    if (points.empty() || sampler.next() < 0.5F) return x;
    const auto i = static_cast<std::size_t>(sampler.next() * static_cast<float>(points.size()));
    return points[std::min(i, points.size() - 1)];
}

}  // namespace lucerna
