#include "photon/evenness.h"

#include <algorithm>

namespace lucerna {

void EvennessTest::add(const V3f& offset, float rho2, const Rgb& power) {
    const auto ring = std::min(static_cast<std::size_t>(rho2 * float{kRings}), kRings - 1);
    const std::size_t sector =
        (offset.dot(frame_.s) < 0 ? std::size_t{1} : 0) + (offset.dot(frame_.t) < 0 ? std::size_t{2} : 0);
    const V3d w(power);
    sums_[ring * kSectors + sector] += w;
    squares_ += w * w;
}

bool EvennessTest::finds_structure() const {
    V3d total(0.0);
    for (const V3d& sum : sums_) total += sum;
    for (int c = 0; c < 3; ++c) {
        if (!(squares_[c] > 0)) continue;
        const double mean = total[c] / double{kCells};
        double scatter = 0;
        for (const V3d& sum : sums_) scatter += sqr(sum[c] - mean);
        if (scatter * double{kCells} > kCritical * squares_[c]) return true;
    }
    return false;
}

}  // namespace lucerna
