// Many small pictures as one.
#pragma once

#include <functional>

#include "engine/base/image.h"

namespace lucerna {

// Lays `count` pictures of one size out in rows of `columns`, the first at the top left, with lines of `gap`
// dark grey pixels between them. paint(i, image, x, y) draws picture i with its top left corner at (x, y).
Image contact_sheet(int count, int columns, const V2i& size, int gap,
                    const std::function<void(int i, Image& sheet, int x, int y)>& paint);

// The mean of `factor` x `factor` pixels each; what is left over at the right and the bottom counts as it is.
Image shrunk(const Image& image, int factor);

// The level below which `share` of the values lies; 0 of none.
double level(std::vector<double> values, double share);

}  // namespace lucerna
