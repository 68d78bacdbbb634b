#include "photon/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/frame.h"
#include "engine/base/hash.h"
#include "photon/deposit.h"

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
// misses 3.38 n^(-2/3) of the area (Rényi and Sulanke 1963), and where the kernel falls to 0 at the rim the
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

// The squared distance from the centre below which a share u of the kernel lies; u in [0,1).
float kernel_radius2(KernelShape kernel, float u) {
    switch (kernel) {
        case KernelShape::constant:
            return u;
        case KernelShape::cone:  // 3ρ² - 2ρ³ = u
            return sqr(0.5F - std::sin(std::asin(1 - 2 * u) / 3));
        case KernelShape::epanechnikov:  // 2ρ² - ρ⁴ = u
            return 1 - std::sqrt(1 - u);
    }
    return 0;
}

// Place `i` of `count` in the kernel's own measure, from the middle outwards: a net of the square, moved
// around its torus.
V2f probe_place(int i, int count, const V2f& shift) {
    constexpr float kGolden = 0.61803399F;
    const V2f u((static_cast<float>(i) + shift.x) / static_cast<float>(count),
                static_cast<float>(i) * kGolden + shift.y);
    return {u.x, u.y - std::floor(u.y)};
}

class Prober {
  public:
    Prober(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric)
        : scene_(scene),
          disc_(disc),
          metric_(metric),
          frame_(disc.n),
          lift_(0.02F * std::sqrt(disc.r2)),
          eye_(disc.x + lift_ * disc.n) {}

    // Where the kernel's own measure has the place u, from x.
    V3f place(const V2f& u) const {
        const float rho = std::sqrt(kernel_radius2(disc_.kernel, u.x) * disc_.r2), phi = 2 * kPi * u.y;
        return rho * std::cos(phi) * frame_.s + rho * std::sin(phi) * frame_.t;
    }
    // Whether nothing stands between the place and x.
    bool is_open(const V3f& y) const { return sees(eye_ + y); }
    // Whether a photon along d that crosses the disc at y would have been counted. Behind a wall only what
    // the wall's front has caught has come from this side.
    bool counts(const V3f& y, bool open, const V3f& d) const {
        // Along the path, only what lies in the ball counts: from where it enters to where it leaves.
        const float middle = -y.dot(d);
        const float half = std::sqrt(std::max(0.0F, sqr(middle) + disc_.ball2 - y.length2()));
        const auto rests = rest({disc_.x + y + (middle - half) * d, d, 2 * half});
        return rests && (open || sees(*rests - lift_ * d));
    }

  private:
    // Where a photon on this way comes to rest within the disc. Glass, and whatever else lets light through,
    // is no edge: photons rest beyond it, if not by this way then by another that it bends.
    std::optional<V3f> rest(Ray way) const {
        constexpr int kMostPanes = 8;
        for (int i = 0; i < kMostPanes; ++i) {
            const auto hit = scene_.hit(way);
            if (!hit) return std::nullopt;
            const Bsdf bsdf = scene_.bsdf(*hit);
            if (stores_photons(bsdf)) {
                // A hair more than the disc: on a flat surface every probe counts, however it is rounded.
                const V3f& p = hit->at.p;
                const bool near = metric_(p, way.d, (p - disc_.x).length2()) <= 1.01F * disc_.r2;
                return near ? std::optional(p) : std::nullopt;
            }
            if (!bsdf.transmits()) return std::nullopt;
            way = Ray{hit->at.towards(way.d), way.d, way.t_max - hit->t};
        }
        return std::nullopt;
    }
    // Whether nothing stands between a point and the one just over x.
    bool sees(const V3f& p) const {
        const V3f way = p - eye_;
        const float distance = way.length();
        return !(distance > 0) || scene_.visible(SurfacePoint{eye_}, way / distance, distance);
    }

    const Scene& scene_;
    const ProbedDisc& disc_;
    const TangentMetric& metric_;
    Frame frame_;
    float lift_;
    V3f eye_;
};

}  // namespace

V2f probe_shift(const V3f& x) {
    WordHash hash;
    for (int c = 0; c < 3; ++c) hash.add(x[c]);
    const std::uint64_t bits = hash.value() * 0x9e3779b97f4a7c15U;
    return {static_cast<float>(bits >> 40) * 0x1p-24F, static_cast<float>(bits >> 16 & 0xffffffU) * 0x1p-24F};
}

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

float probed_share(const Scene& scene, const ProbedDisc& disc, const TangentMetric& metric,
                   std::span<const V3f> directions) {
    const Prober prober(scene, disc, metric);
    const V2f shift = probe_shift(disc.x);
    const std::size_t count = std::min<std::size_t>(directions.size(), kProbedDirections);

    // Edges and walls cut off the rim first: where it is open, so is the rest.
    constexpr int kRimProbes = 4;
    bool whole = true;
    for (int i = 0; whole && i < kRimProbes; ++i) {
        const V2f u(0.75F + 0.25F * shift.x, (static_cast<float>(i) + shift.y) / kRimProbes);
        const V3f y = prober.place(u);
        whole = prober.is_open(y) && prober.counts(y, true, directions[static_cast<std::size_t>(i) % count]);
    }
    if (whole) return 1;

    // The same places for all directions: what they have in common is no scatter between their shares.
    std::array<int, kProbedDirections> counted{};
    for (int i = 0; i < kProbes; ++i) {
        const V3f y = prober.place(probe_place(i, kProbes, shift));
        const bool open = prober.is_open(y);
        for (std::size_t j = 0; j < count; ++j) counted[j] += prober.counts(y, open, directions[j]);
    }
    float sum = 0;
    for (std::size_t j = 0; j < count; ++j) {
        sum +=
            static_cast<float>(kProbes) / static_cast<float>(std::max(counted[j], 1));  // the photon itself
    }
    return static_cast<float>(count) / sum;
}

}  // namespace lucerna
