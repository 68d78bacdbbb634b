// Counts a lobe's samples in bins as fine as the lobe.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <vector>

#include "engine/base/vec.h"

namespace lucerna::testing {

// A histogram of the hemisphere in which w.z has the sign of `side`, in rings about the lobe's peak that
// widen geometrically, so that it resolves lobes of any width.
class PeakHistogram {
  public:
    static constexpr int kSectors = 12;

    PeakHistogram(const V3f& peak, float side, float width) : frame_(peak), side_(side) {
        edges_.push_back(0);
        const double first = std::min(static_cast<double>(width), 0.3) / 2;
        for (double edge = first; edge < 0.8 * std::numbers::pi; edge *= 1.7) edges_.push_back(edge);
        edges_.push_back(std::numbers::pi);
        counts.resize((edges_.size() - 1) * kSectors);
    }

    bool add(const V3f& w) {
        if (!(w.z * side_ > 0)) return false;
        const V3f v = frame_.to_local(w);
        // atan2 of sine and cosine keeps angles near the peak exact.
        const double theta = std::atan2(std::hypot(static_cast<double>(v.x), static_cast<double>(v.y)),
                                        static_cast<double>(v.z));
        const double phi =
            std::atan2(static_cast<double>(v.y), static_cast<double>(v.x)) / (2 * std::numbers::pi);
        const auto ring = std::upper_bound(edges_.begin() + 1, edges_.end() - 1, theta) - edges_.begin() - 1;
        const int sector = std::min(static_cast<int>((phi - std::floor(phi)) * kSectors), kSectors - 1);
        ++counts[static_cast<std::size_t>(ring) * kSectors + static_cast<std::size_t>(sector)];
        return true;
    }

    // Returns the probability of every bin, by the midpoint rule.
    std::vector<double> integrate(const std::function<double(const V3f&)>& pdf) const {
        constexpr int kSteps = 32;
        std::vector<double> bins;
        for (std::size_t ring = 0; ring + 1 < edges_.size(); ++ring) {
            const double d_theta = (edges_[ring + 1] - edges_[ring]) / kSteps;
            const double d_phi = 2 * std::numbers::pi / kSectors / kSteps;
            for (int sector = 0; sector < kSectors; ++sector) {
                double sum = 0;
                for (int i = 0; i < kSteps * kSteps; ++i) {
                    const double theta = edges_[ring] + (i / kSteps + 0.5) * d_theta;
                    const double phi = (sector * kSteps + i % kSteps + 0.5) * d_phi;
                    const double s = std::sin(theta);
                    const V3f w =
                        frame_.to_world(V3f(V3d(s * std::cos(phi), s * std::sin(phi), std::cos(theta))));
                    if (w.z * side_ > 0) sum += pdf(w) * s;
                }
                bins.push_back(sum * d_theta * d_phi);
            }
        }
        return bins;
    }

    std::vector<std::uint64_t> counts;

  private:
    Frame frame_;
    float side_;
    std::vector<double> edges_;
};

}  // namespace lucerna::testing
