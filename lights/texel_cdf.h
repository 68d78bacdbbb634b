// Drawing texels of an image in proportion to weights: first the row, then the column, so that 24 bits of a
// float reach every texel of a large image.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/vec.h"

namespace lucerna {

class TexelCdf {
  public:
    TexelCdf() = default;
    // weight(x, y) is finite and not negative; called once for every texel.
    TexelCdf(int width, int height, const std::function<double(int x, int y)>& weight);

    double total() const { return rows_.total(); }

    struct Draw {
        int x, y;
        double probability;  // > 0
        V2f within;          // uniform in [0,1)² again
    };
    // u in [0,1)². Requires total() > 0. A texel of weight 0 is never drawn.
    Draw draw(const V2f& u) const;
    double probability(int x, int y) const;  // 0 if total() is

  private:
    Cdf rows_;
    std::vector<Cdf> columns_;  // of each row
};

}  // namespace lucerna
