#include "lights/measurement/median.h"

#include <algorithm>

namespace lucerna {

float median_of(std::span<float> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) return *middle;
    return 0.5F * (*std::max_element(values.begin(), middle) + *middle);
}

std::vector<float> median_5x5(std::span<const float> image, const V2i& size, const Workers& workers) {
    std::vector<float> medians(image.size());
    parallel_chunks(workers, size.y, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x < size.x; ++x) {
            medians[static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
                    static_cast<std::size_t>(x)] =
                median_around(image, size, {x, y}, 0, [](std::size_t) { return true; });
        }
    });
    return medians;
}

}  // namespace lucerna
