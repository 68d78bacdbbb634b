// Measures the distance of a photon as that at which its path crosses the tangent plane [Lastra 2002; Goesele
// 2003, 5.2].
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/vec.h"
#include "kdtree/box_tree.h"
#include "photon/photon.h"

namespace lucerna {

enum class MetricKind : std::uint8_t { projected, euclidean };

// Bounds the slope of photons to the plane: flatter ones (0.45°, or up to sqrt 3 times that, depending on the
// photon's direction) slide no further than one of exactly this slope. Without a bound, the rounding of n·(x
// - x_i), divided by n·d → 0, would push photons out of the disc on a perfectly flat surface. Less than 2e-4
// of a diffuse field's flux (sin² of the slope) arrives below it.
inline constexpr float kGrazing = 1.0F / 128;

// Computes squared distances from x on the side of n (unit); infinite if the photon does not count. Also the
// measure of a search in a BoxTree whose payloads are packed directions of travel.
class TangentMetric {
  public:
    // `ratio` >= 1: a photon counts within distance r only if it lies within ratio·r in space. This keeps the
    // search a ball, and excludes photons that project onto x from far away.
    TangentMetric(const V3f& x, const V3f& n, MetricKind kind, float ratio)
        : x_(x), n_(n), kind_(kind), inverse_ratio2_(1 / (ratio * ratio)) {}

    MetricKind kind() const { return kind_; }

    // Returns where a photon at x_i, travelling along d, crosses the plane through x, as the offset from x.
    // Treats grazing photons as the distance does.
    V3f crossing(const V3f& x_i, const V3f& d) const {
        const V3f v = x_i - x_;
        if (kind_ == MetricKind::euclidean) return v;
        return v - n_.dot(v) / std::min(n_.dot(d), -kGrazing) * d;  // never divided by less than kGrazing
    }

    // Returns the larger of the projected distance and the Euclidean distance divided by `ratio`, squared.
    // `d` is the photon's direction of travel, of length 1/sqrt 3 to 1, and `r2` its squared Euclidean
    // distance. On a flat surface with ratio >= 1 the result is r2 itself.
    float operator()(const V3f& x_i, const V3f& d, float r2) const {
        const float slope = n_.dot(d);
        if (!(slope < 0)) return INFINITY;  // arrived from behind, so it lies on the other side
        return kind_ == MetricKind::euclidean ? r2 : projected(x_ - x_i, d, slope, r2);
    }

    // Returns the squared radius in space that holds every photon within squared distance d2, with a margin
    // for rounding.
    float ball2(float d2) const {
        return kind_ == MetricKind::euclidean ? d2 : d2 / inverse_ratio2_ * (1 + 4 * kRounding);
    }

    BlockKeys keys(const PointBlock& block) const {
        return kind_ == MetricKind::euclidean ? keys_by<MetricKind::euclidean>(block)
                                              : keys_by<MetricKind::projected>(block);
    }
    Node8Keys bounds(const BoxNode8& node) const;
    Node8Keys bounds(const BoxNode8& node, const BoxNode8& directions) const;

  private:
    // The least and greatest axis·(p - from) over the p in a box, and the magnitude of the terms, which
    // bounds the rounding error. NaN or infinite if there is no box.
    struct Extent {
        float lowest, highest, terms;
    };
    [[gnu::always_inline]] static Extent extent(const V3f& axis, const BoxNode8& node, std::size_t i,
                                                const V3f& from);
    [[gnu::always_inline]] static V3f middle(const BoxNode8& node, std::size_t i);
    [[gnu::always_inline]] float slid(const BoxNode8& node, const BoxNode8& directions, std::size_t i) const;
    Node8Keys from_behind(Node8Keys bounds, const BoxNode8& directions) const;

    static constexpr float kRounding = 1.2e-7F;  // of one operation: twice the error of float32

    // v = x - x_i, slope = n·d < 0. The length of d cancels, so it need not be a unit vector.
    float projected(const V3f& v, const V3f& d, float slope, float r2) const {
        const float a =
            n_.dot(v) / std::min(slope, -kGrazing);  // the divisor is never closer to 0 than kGrazing
        // |x_i + a d - x|², computed from the vector: the expanded form a² - 2a(d·v) + v² suffers
        // cancellation and can become negative.
        const float projected2 = (a * d - v).length2();
        return std::max(projected2, r2 * inverse_ratio2_);
    }

    template <MetricKind kKind>
    BlockKeys keys_by(const PointBlock& block) const {
        BlockKeys slopes;
        BlockKeys keys;
        for (std::size_t i = 0; i < kBlock; ++i) {
            const V3f v = x_ - V3f(block.x[i], block.y[i], block.z[i]);
            const V3f d = PackedDirection::along(block.payload[i]);
            const float r2 = v.length2();
            slopes[i] = n_.dot(d);
            keys[i] = kKind == MetricKind::euclidean ? r2 : projected(v, d, slopes[i], r2);
        }
        // A separate loop: within the first, a compiler would make this a branch around the work and handle
        // photons one by one.
        for (std::size_t i = 0; i < kBlock; ++i) keys[i] = slopes[i] < 0 ? keys[i] : INFINITY;
        return keys;
    }

    V3f x_, n_;
    MetricKind kind_;
    float inverse_ratio2_;
};

// At every corner, axis·(p - from) lies between the sum over the coordinates of the lower terms and that of
// the higher terms.
inline TangentMetric::Extent TangentMetric::extent(const V3f& axis, const BoxNode8& node, std::size_t i,
                                                   const V3f& from) {
    const V3f a((node.low_x[i] - from.x) * axis.x, (node.low_y[i] - from.y) * axis.y,
                (node.low_z[i] - from.z) * axis.z);
    const V3f b((node.high_x[i] - from.x) * axis.x, (node.high_y[i] - from.y) * axis.y,
                (node.high_z[i] - from.z) * axis.z);
    return {std::min(a.x, b.x) + std::min(a.y, b.y) + std::min(a.z, b.z),
            std::max(a.x, b.x) + std::max(a.y, b.y) + std::max(a.z, b.z),
            std::max(std::fabs(a.x), std::fabs(b.x)) + std::max(std::fabs(a.y), std::fabs(b.y)) +
                std::max(std::fabs(a.z), std::fabs(b.z))};
}

inline V3f TangentMetric::middle(const BoxNode8& node, std::size_t i) {
    return 0.5F * V3f(node.low_x[i] + node.high_x[i], node.low_y[i] + node.high_y[i],
                      node.low_z[i] + node.high_z[i]);
}

// Returns lower bounds of the distances of photons in boxes. In space, the bound is the distance of the box.
// In the tangent plane, a photon at height h above the plane lies sqrt(r² - h²) from x along it and slides by
// at most |h|/kGrazing. A box of small height, as all are on a flat surface, is thus about as far as it lies,
// and the search visits the disc instead of the ball that is `ratio` times as wide.
inline Node8Keys TangentMetric::bounds(const BoxNode8& node) const {
    Node8Keys bounds = box_distances2(node, x_);
    if (kind_ == MetricKind::euclidean) return bounds;
    for (std::size_t i = 0; i < kNodeWidth; ++i) {
        const auto [lowest, highest, terms] = extent(n_, node, i, x_);
        // Bounds the height |n·v| as computed for a photon, with rounding.
        const float height = std::max(highest, -lowest) + 8 * kRounding * terms;
        const float along = std::sqrt(std::max(bounds[i] - height * height, 0.0F));
        const float least = std::max(along - height / kGrazing, 0.0F);
        // The factor 0.999 allows for the rounding of all this.
        bounds[i] = std::max(bounds[i] * inverse_ratio2_, least * least * 0.999F);
    }
    return bounds;
}

// Returns a lower bound of the distance from x to where the photons in a box cross the plane. A photon at
// height h, travelling along d, crosses it at its place plus h/|n·d| times d. The bound is the least
// component of this along one direction, that from x to where a photon in the middle of both boxes crosses
// the plane, by interval arithmetic. Any vector of length <= 1 gives a valid bound, also none. NaN if there
// is no box.
inline float TangentMetric::slid(const BoxNode8& node, const BoxNode8& directions, std::size_t i) const {
    const V3f crosses = crossing(middle(node, i), middle(directions, i));
    const V3f tangent = crosses - n_.dot(crosses) * n_;
    const V3f u = tangent / std::sqrt(std::max(tangent.length2(), 1e-30F));

    const Extent height = extent(n_, node, i, x_);
    const float low = height.lowest - 8 * kRounding * height.terms;
    const float high = height.highest + 8 * kRounding * height.terms;
    const Extent slope = extent(n_, directions, i, V3f(0));  // its terms, and those of `travel`, are < 2
    const float steepest = std::max(kGrazing, 8 * kRounding - slope.lowest);    // divisors, never
    const float flattest = std::max(kGrazing, -8 * kRounding - slope.highest);  // closer to 0 than kGrazing
    const float least = low / (low >= 0 ? steepest : flattest);
    const float most = high / (high >= 0 ? flattest : steepest);

    const Extent travel = extent(u, directions, i, V3f(0));
    const float back = travel.lowest - 8 * kRounding, forth = travel.highest + 8 * kRounding;
    const float shift = std::min(std::min(least * back, least * forth), std::min(most * back, most * forth));
    const Extent from_x = extent(u, node, i, x_);
    const float size = from_x.terms + std::max(std::fabs(least), std::fabs(most));
    return from_x.lowest + shift - 8 * kRounding * size;
}

// Also uses the photons' directions, so that a search beside a narrow beam, or beside a caustic on a surface
// that meets this one at an edge, need not test its photons one by one. On the dark side of an object in the
// beam all photons arrive from behind and are infinitely far; the others cross the plane far from x.
inline Node8Keys TangentMetric::bounds(const BoxNode8& node, const BoxNode8& directions) const {
    Node8Keys all = bounds(node);
    if (kind_ == MetricKind::euclidean) return from_behind(all, directions);
    for (std::size_t i = 0; i < kNodeWidth; ++i) {
        const float least = std::max(0.0F, slid(node, directions, i));  // 0 for NaN
        all[i] = std::max(all[i], 0.999F * least * least);
    }
    return from_behind(all, directions);
}

inline Node8Keys TangentMetric::from_behind(Node8Keys bounds, const BoxNode8& directions) const {
    for (std::size_t i = 0; i < kNodeWidth; ++i) {
        // The threshold exceeds the rounding of n·d for a photon.
        if (extent(n_, directions, i, V3f(0)).lowest > 8 * kRounding) bounds[i] = INFINITY;
    }
    return bounds;
}

// Density kernels on the unit disc, each with integral 1 over the disc [Jensen 2001, 7.4]. `x2` is (d/r)², in
// [0,1].
enum class KernelShape : std::uint8_t { constant, cone, epanechnikov };

// Selects the correction for discs that extend beyond the edge of their surface: none, or probes (probes.h).
enum class Boundary : std::uint8_t { none, probes };

inline float kernel(KernelShape shape, float x2) {
    switch (shape) {
        case KernelShape::constant:
            return kInvPi;
        case KernelShape::cone:
            return 3 * kInvPi * (1 - std::sqrt(x2));
        case KernelShape::epanechnikov:
            return 2 * kInvPi * (1 - x2);
    }
    return 0;
}

}  // namespace lucerna
