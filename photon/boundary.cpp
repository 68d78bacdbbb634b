#include "photon/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lucerna {
namespace {

float cross(const V2f& a, const V2f& b) {
    return a.x * b.y - a.y * b.x;
}

// ∫ |y| over the triangle (0, a, b), > 0 if it turns left: h/6 [s |y| + h² asinh(s/h)] from a to b, with h
// the distance of its far side and s the place along that.
float first_moment(const V2f& a, const V2f& b) {
    const V2f side = b - a;
    const float length = side.length();
    const float twice_area = cross(a, b);
    if (!(length > 0) || !(twice_area > 1e-12F)) return 0;
    const float h = twice_area / length;
    const float s_a = a.dot(side) / length, s_b = b.dot(side) / length;
    return h / 6 *
           (s_b * b.length() - s_a * a.length() + h * h * (std::asinh(s_b / h) - std::asinh(s_a / h)));
}

// ∫ K over the triangle (0, a, b) within the unit disc.
float wedge(KernelShape kernel, const V2f& a, const V2f& b) {
    const float area = cross(a, b) / 2;
    switch (kernel) {
        case KernelShape::constant:
            return kInvPi * area;
        case KernelShape::cone:
            return 3 * kInvPi * (area - first_moment(a, b));
        case KernelShape::epanechnikov:
            return 2 * kInvPi * area * (1 - (a.length2() + a.dot(b) + b.length2()) / 6);
    }
    return 0;
}

// Andrew's monotone chain: the corners counter-clockwise, into `hull`.
void convex_hull(std::vector<V2f>& points, std::vector<V2f>& hull) {
    std::sort(points.begin(), points.end(),
              [](const V2f& a, const V2f& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
    hull.clear();
    const auto chain = [&](auto begin, auto end) {
        const std::size_t base = hull.size();
        for (auto p = begin; p != end; ++p) {
            while (hull.size() >= base + 2 &&
                   cross(hull.back() - hull[hull.size() - 2], *p - hull.back()) <= 0) {
                hull.pop_back();
            }
            hull.push_back(*p);
        }
        hull.pop_back();  // the other chain begins with it
    };
    chain(points.begin(), points.end());
    chain(points.rbegin(), points.rend());
}

// The mean share of the kernel over the hull of n photons that lie evenly over the whole disc. The hull
// misses 3.38 n^(-2/3) of the area [Rényi and Sulanke 1963], and where the kernel falls to 0 at the rim the
// square of that times a constant; the rest is fitted to what many hulls gave, within 0.01 for n >= kFewest.
constexpr float kFewest = 8;
float whole_hull(KernelShape kernel, float n) {
    const float t = std::pow(n, -2.0F / 3);
    switch (kernel) {
        case KernelShape::constant:
            return 1 - 3.38F * t / (1 + 1.15F * t);
        case KernelShape::cone:
            return 1 - 11.3F * t * t / (1 + t * (1.3F + 4.5F * t));
        case KernelShape::epanechnikov:
            return 1 - 14.8F * t * t / (1 + t * (1.7F + 8.2F * t));
    }
    return 1;
}

}  // namespace

V3f crossing(const V3f& x, const V3f& n, const V3f& x_i, const V3f& d, MetricKind metric) {
    const V3f v = x_i - x;
    if (metric == MetricKind::euclidean) return v;
    return v - n.dot(v) / std::min(n.dot(d), -kGrazing) * d;  // never divided by less than kGrazing
}

float hull_share(KernelShape kernel, std::vector<V2f>& points) {
    const auto count = static_cast<float>(points.size());
    if (count < kFewest) return 1;
    points.emplace_back(0.0F, 0.0F);
    std::vector<V2f> hull;
    convex_hull(points, hull);
    float share = 0;
    for (std::size_t i = 0; i < hull.size(); ++i)
        share += wedge(kernel, hull[i], hull[(i + 1) % hull.size()]);
    return share > 0 ? share / whole_hull(kernel, count) : 1.0F;
}

}  // namespace lucerna
