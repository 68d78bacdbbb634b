// Draws texels of an image in proportion to weights: first the row, then the column, so that the 24 bits of a
// float reach every texel of a large image.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "engine/base/cdf.h"
#include "engine/base/sampler.h"
#include "engine/base/vec.h"

namespace lucerna {

class TexelCdf {
  public:
    TexelCdf() = default;
    // weight(x, y) is finite and not negative; it is called once for every texel.
    TexelCdf(int width, int height, const std::function<double(int x, int y)>& weight);

    double total() const { return rows_.total(); }

    struct Draw {
        int x, y;
        double probability;  // > 0
        V2f within;          // uniform in [0,1)² again
    };
    // Requires u in [0,1)² and total() > 0. A texel of weight 0 is never drawn.
    Draw draw(const V2f& u) const;
    double probability(int x, int y) const;  // 0 if total() is 0

  private:
    Cdf rows_;
    std::vector<Cdf> columns_;  // one for each row
};

inline TexelCdf::TexelCdf(int width, int height, const std::function<double(int x, int y)>& weight) {
    std::vector<double> row(static_cast<std::size_t>(width)), sums;
    columns_.reserve(static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = weight(x, y);
        columns_.emplace_back(row);
        sums.push_back(columns_.back().total());
    }
    rows_ = Cdf(sums);
}

inline TexelCdf::Draw TexelCdf::draw(const V2f& u) const {
    const Cdf::Draw row = rows_.draw(u.y);
    const Cdf::Draw column = columns_[row.item].draw(u.x);  // a drawn row has weight > 0
    return {static_cast<int>(column.item),
            static_cast<int>(row.item),
            row.probability * column.probability,
            {column.remainder, row.remainder}};
}

inline double TexelCdf::probability(int x, int y) const {
    const auto row = static_cast<std::size_t>(y);
    if (!(rows_.total() > 0) || !(columns_[row].total() > 0)) return 0;
    return rows_.probability(row) * columns_[row].probability(static_cast<std::size_t>(x));
}

}  // namespace lucerna
