// A comparison as one HTML file that carries all it needs: images with a slider, a flip, zoom and exposure,
// maps of the errors, and the numbers.
#pragma once

#include <string>
#include <vector>

#include "engine/evaluation/comparison.h"

namespace lucerna {

// `error_range`: the relative error that is shown in full colour. Images of more than 2048 pixels on a side
// are shrunk by a whole factor, and the page says so.
std::string comparison_page(const ComparisonReport& report, const std::vector<NamedImage>& images,
                            const NamedImage& reference, double error_range);

}  // namespace lucerna
