#include "engine/evaluation/contact_sheet.h"

#include <algorithm>

namespace lucerna {

Image contact_sheet(int count, int columns, const V2i& size, int gap,
                    const std::function<void(int i, Image& sheet, int x, int y)>& paint) {
    const int across = std::min(count, columns), down = (count + columns - 1) / columns;
    Image sheet = Image::rgb(across * (size.x + gap) - gap, down * (size.y + gap) - gap);
    constexpr float kGrey = 0.05F;
    std::fill(sheet.data.begin(), sheet.data.end(), kGrey);
    for (int i = 0; i < count; ++i)
        paint(i, sheet, i % columns * (size.x + gap), i / columns * (size.y + gap));
    return sheet;
}

Image shrunk(const Image& image, int factor) {
    if (factor <= 1) return image;
    Image small = Image::rgb((image.width + factor - 1) / factor, (image.height + factor - 1) / factor);
    for (int y = 0; y < small.height; ++y) {
        for (int x = 0; x < small.width; ++x) {
            Rgb sum(0);
            int count = 0;
            for (int j = y * factor; j < std::min(image.height, (y + 1) * factor); ++j) {
                for (int i = x * factor; i < std::min(image.width, (x + 1) * factor); ++i, ++count)
                    sum += image.rgb_at(i, j);
            }
            small.set_rgb(x, y, sum / static_cast<float>(count));  // every block holds at least one pixel
        }
    }
    return small;
}

double level(std::vector<double> values, double share) {
    if (values.empty()) return 0;
    const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + at, values.end());
    return values[static_cast<std::size_t>(at)];
}

}  // namespace lucerna
