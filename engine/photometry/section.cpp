#include "engine/photometry/section.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace lucerna {
namespace {

constexpr double kNearLine = 2e-3;      // m
constexpr double kSameNormal = 0.9994;  // cos 2°
constexpr int kMostHits = 256;          // along a ray
constexpr std::size_t kMostRays = 4000;

// A line that grows from one ray to the next.
struct Growing {
    V3d from, to, n;  // ends, and the unit normal in the plane
    int last = 0;     // number of the ray that met it last
};

// Collects what the rays along one axis meet.
class Sweep {
  public:
    Sweep(const Scene& scene, const Imath::Box<V3d>& box, int along, int across, int up, double height)
        : scene_(scene), box_(box), along_(along), across_(across), up_(up), height_(height) {}

    std::vector<SectionLine> lines(double spacing) {
        const double width = box_.max[across_] - box_.min[across_];
        const auto count = std::min(kMostRays, static_cast<std::size_t>(std::ceil(width / spacing)));
        step_ = width / static_cast<double>(count);
        for (std::size_t i = 0; i < count; ++i)
            cast(static_cast<int>(i), box_.min[across_] + (static_cast<double>(i) + 0.5) * step_);
        std::vector<SectionLine> lines;
        for (const Growing& line : grown_) lines.push_back({line.from, line.to});
        return lines;
    }

  private:
    void cast(int number, double at) {
        V3d from(0);
        from[along_] = box_.min[along_];
        from[across_] = at;
        from[up_] = height_;
        V3f d(0);
        d[along_] = 1;
        Ray ray{V3f(from - scene_.origin()), d, static_cast<float>(box_.max[along_] - box_.min[along_])};
        for (int hits = 0; hits < kMostHits; ++hits) {
            const auto hit = scene_.intersect(ray);
            if (!hit) return;
            V3d n(hit->at.n);
            n[up_] = 0;
            // Rays along the other axis meet steeper surfaces better.
            if (std::fabs(n[along_]) > 0.7 * n.length())
                add(number, V3d(hit->at.p) + scene_.origin(), n.normalized());
            const float step = std::max(hit->at.error, 1e-6F * (1 + hit->t));
            ray.o = hit->at.p + step * d;
            ray.t_max -= hit->t + step;
            if (!(ray.t_max > 0)) return;
        }
    }

    void add(int number, const V3d& p, const V3d& n) {
        V3d along(0);  // the line's direction, one step across the rays
        along[across_] = step_;
        along[along_] = -step_ * n[across_] / n[along_];  // |n[along_]| > 0.7
        for (std::size_t i = grown_.size(); i-- > 0;) {
            Growing& line = grown_[i];
            if (line.last != number - 1 || std::fabs(line.n.dot(n)) < kSameNormal ||
                std::fabs(line.n.dot(p - line.to)) > kNearLine)
                continue;
            line.last = number;
            line.to = p + 0.5 * along;
            return;
        }
        grown_.push_back({p - 0.5 * along, p + 0.5 * along, n, number});
    }

    const Scene& scene_;
    const Imath::Box<V3d>& box_;
    int along_, across_, up_;
    double height_, step_ = 0;
    std::vector<Growing> grown_;
};

}  // namespace

std::vector<SectionLine> section(const Scene& scene, const Imath::Box<V3d>& box, int up_axis, double height,
                                 double spacing) {
    const int a = (up_axis + 1) % 3, b = (up_axis + 2) % 3;
    std::vector<SectionLine> lines = Sweep(scene, box, a, b, up_axis, height).lines(spacing);
    const std::vector<SectionLine> others = Sweep(scene, box, b, a, up_axis, height).lines(spacing);
    lines.insert(lines.end(), others.begin(), others.end());
    return lines;
}

}  // namespace lucerna
