// How far away a photon is: the distance at which its path crosses the tangent plane [photon-maps 2; LF 5.2].
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "engine/base/vec.h"

namespace lucerna {

enum class MetricKind : std::uint8_t { projected, euclidean };

// Photons flatter than this to the plane slide no further than one of exactly this slope (0.45°). Without a
// bound the rounding of n·(x - x_i), divided by n·d → 0, would push photons out of the disc on a perfectly
// flat surface; below it arrives less than 1e-4 of a diffuse field's flux (sin² of the slope).
inline constexpr float kGrazing = 1.0F / 128;

// Squared distances from x, seen from the side of n (unit). Infinite: the photon does not count.
class TangentMetric {
  public:
    // `ratio` >= 1: a photon counts within distance r only if it rests within ratio·r in space. That keeps
    // the search a ball, and keeps out photons that project onto x from the other end of a long way.
    TangentMetric(const V3f& x, const V3f& n, MetricKind kind, float ratio)
        : x_(x), n_(n), kind_(kind), inverse_ratio2_(1 / (ratio * ratio)) {}

    // The larger of the projected distance and the share of the distance in space: `d` is the photon's
    // direction of travel, `r2` its squared Euclidean distance. On a flat surface with ratio >= 1 this is r2
    // itself.
    float operator()(const V3f& x_i, const V3f& d, float r2) const {
        const float slope = n_.dot(d);
        if (!(slope < 0)) return INFINITY;  // arrived from behind: the surface-side filter
        if (kind_ == MetricKind::euclidean) return r2;
        const V3f v = x_ - x_i;
        const float a =
            n_.dot(v) / std::min(slope, -kGrazing);  // the divisor is never closer to 0 than kGrazing
        // |x_i + a d - x|². Taken from the vector: the expanded form a² - 2a(d·v) + v² cancels and can go
        // negative.
        const float projected2 = (a * d - v).length2();
        return std::max(projected2, r2 * inverse_ratio2_);
    }

    // The squared radius in space that holds every photon within squared distance d2.
    float ball2(float d2) const { return kind_ == MetricKind::euclidean ? d2 : d2 / inverse_ratio2_; }

  private:
    V3f x_, n_;
    MetricKind kind_;
    float inverse_ratio2_;
};

}  // namespace lucerna
