#include "lights/texel_cdf.h"

namespace lucerna {

TexelCdf::TexelCdf(int width, int height, const std::function<double(int x, int y)>& weight) {
    std::vector<double> row(static_cast<std::size_t>(width)), sums;
    columns_.reserve(static_cast<std::size_t>(height));
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x)] = weight(x, y);
        columns_.emplace_back(row);
        sums.push_back(columns_.back().total());
    }
    rows_ = Cdf(sums);
}

TexelCdf::Draw TexelCdf::draw(const V2f& u) const {
    const Cdf::Draw row = rows_.draw(u.y);
    const Cdf::Draw column = columns_[row.item].draw(u.x);  // the row has weight, or it were not drawn
    return {static_cast<int>(column.item),
            static_cast<int>(row.item),
            row.probability * column.probability,
            {column.remainder, row.remainder}};
}

double TexelCdf::probability(int x, int y) const {
    const auto row = static_cast<std::size_t>(y);
    if (!(rows_.total() > 0) || !(columns_[row].total() > 0)) return 0;
    return rows_.probability(row) * columns_[row].probability(static_cast<std::size_t>(x));
}

}  // namespace lucerna
