#include "engine/base/cdf.h"

#include <algorithm>

namespace lucerna {

Cdf::Cdf(std::span<const double> weights) {
    upto_.reserve(weights.size() + 1);
    upto_.push_back(0);
    for (const double w : weights) {
        assert(std::isfinite(w) && w >= 0);
        upto_.push_back(upto_.back() + w);
    }
}

Cdf::Draw Cdf::draw(float u) const {
    assert(total() > 0);
    const double x = static_cast<double>(u) * upto_.back();
    // The first boundary beyond x closes the item that holds x; an item of weight 0 closes where it opens.
    auto beyond = std::upper_bound(upto_.begin() + 1, upto_.end(), x);
    if (beyond == upto_.end()) {
        // Rounding put x on the last boundary: take the last item that has weight.
        beyond = std::lower_bound(upto_.begin() + 1, upto_.end(), upto_.back());
    }
    const auto item = static_cast<std::size_t>(beyond - upto_.begin()) - 1;
    const double weight = upto_[item + 1] - upto_[item];
    const double rest = (x - upto_[item]) / weight;  // weight > 0: the boundary lies strictly beyond x
    return {item, weight / upto_.back(), std::min(static_cast<float>(rest), 0x1.fffffep-1F)};
}

}  // namespace lucerna
