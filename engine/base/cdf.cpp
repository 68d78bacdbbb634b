#include "engine/base/cdf.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/base/vec.h"

namespace lucerna {

Cdf::Cdf(std::span<const double> weights) {
    upto_.reserve(weights.size() + 1);
    upto_.push_back(0);
    for (const double w : weights) {
        assert(std::isfinite(w) && w >= 0);
        upto_.push_back(upto_.back() + w);
    }
}

std::vector<double>::const_iterator Cdf::first_beyond(double x) const {
    // Items that fit into the nearest cache are searched without branches, because a random draw's branches
    // are unpredictable.
    constexpr std::size_t kFew = 2048;
    const auto items = upto_.begin() + 1;
    if (size() > kFew) return std::upper_bound(items, upto_.end(), x);
    const double* first = upto_.data() + 1;
    std::size_t n = size();
    while (n > 1) {
        const std::size_t half = n / 2;
        first += half * static_cast<std::size_t>(first[half - 1] <= x);
        n -= half;
    }
    first += static_cast<std::size_t>(*first <= x);
    return upto_.begin() + (first - upto_.data());
}

Cdf::Draw Cdf::draw(float u) const {
    assert(total() > 0);
    if (size() == 1) return {0, 1, u};  // one light, one triangle: no search needed
    const double x = static_cast<double>(u) * upto_.back();
    // The first boundary beyond x ends the item that contains x; an item of weight 0 ends where it begins.
    auto beyond = first_beyond(x);
    if (beyond == upto_.end()) {
        // By rounding, x is on the last boundary: take the last item that has weight.
        beyond = std::lower_bound(upto_.begin() + 1, upto_.end(), upto_.back());
    }
    const auto item = static_cast<std::size_t>(beyond - upto_.begin()) - 1;
    const double weight = upto_[item + 1] - upto_[item];
    const double rest = (x - upto_[item]) / weight;  // weight > 0, because the boundary is strictly beyond x
    return {item, weight / upto_.back(), std::min(static_cast<float>(rest), kBelowOne)};
}

}  // namespace lucerna
