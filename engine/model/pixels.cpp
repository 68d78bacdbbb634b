#include "engine/base/elementary.h"
#include "engine/model/model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lucerna {
namespace {

template <typename Decode>
Rgb mean_of(const Pixels& pixels, Decode decode) {
    std::array<double, 3> sum{};
    const std::size_t count = pixels.rgba.size() / 4;
    for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t c = 0; c < 3; ++c) sum[c] += decode(pixels.rgba[4 * i + c] / 255.0);
    }
    const double per = 1.0 / static_cast<double>(std::max<std::size_t>(1, count));
    return Rgb(static_cast<float>(sum[0] * per), static_cast<float>(sum[1] * per),
               static_cast<float>(sum[2] * per));
}

}  // namespace

Rgb mean_linear(const Pixels& pixels) {
    return mean_of(pixels, [](double v) { return v; });
}

Rgb mean_srgb(const Pixels& pixels) {
    // sRGB decoding of IEC 61966-2-1.
    return mean_of(pixels, [](double v) { return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4); });
}

std::optional<ModelCutout> cutout_of(const Pixels& pixels, double factor, std::optional<double> cutoff) {
    ModelCutout made{pixels.width, pixels.height, {}};
    bool whole = true;
    for (std::size_t i = 3; i < pixels.rgba.size(); i += 4) {
        double alpha = pixels.rgba[i] / 255.0 * factor;
        if (cutoff) alpha = alpha >= *cutoff ? 1 : 0;
        whole = whole && alpha >= 1;
        made.alpha.push_back(static_cast<float>(alpha));
    }
    if (whole) return std::nullopt;
    return made;
}

// Finds the size in a PNG's first chunk, or skips a JPEG's markers by their lengths up to a frame's (SOF).
std::optional<std::pair<std::uint32_t, std::uint32_t>> picture_size(std::span<const std::byte> bytes) {
    const auto at = [&](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
    const auto pair_at = [&](std::size_t i) { return at(i) << 8 | at(i + 1); };
    if (bytes.size() >= 24 && at(0) == 0x89 && at(1) == 'P') {
        return std::pair(pair_at(16) << 16 | pair_at(18), pair_at(20) << 16 | pair_at(22));
    }
    if (bytes.size() < 4 || at(0) != 0xFF || at(1) != 0xD8) return std::nullopt;
    for (std::size_t i = 2; i + 9 <= bytes.size();) {
        if (at(i) != 0xFF) {
            ++i;  // skips to the next marker, as decoders do
            continue;
        }
        const std::uint32_t marker = at(i + 1);
        const bool frame =
            marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
        if (frame) return std::pair(pair_at(i + 7), pair_at(i + 5));
        const bool alone = marker == 0xFF || marker == 0 || (marker >= 0xD0 && marker <= 0xD8);
        i += alone ? 1 : 2 + pair_at(i + 2);
    }
    return std::nullopt;
}

}  // namespace lucerna
