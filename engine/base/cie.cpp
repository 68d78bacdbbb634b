#include "engine/base/cie.h"

#include <algorithm>
#include <cmath>

namespace lucerna {
namespace {

// A Gaussian with one width below its peak and another above.
double lobe(double nanometres, double peak, double below, double above) {
    const double x = (nanometres - peak) / (nanometres < peak ? below : above);
    return std::exp(-0.5 * x * x);
}

}  // namespace

V3d cie_xyz(double nm) {
    return {1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
                0.065 * lobe(nm, 501.1, 20.4, 26.2),
            0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1),
            1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8)};
}

V3d spectrum_to_xyz(std::span<const SpectralSample> samples) {
    if (samples.size() == 1) return samples[0].weight * cie_xyz(samples[0].nanometres);
    V3d sum(0, 0, 0);
    for (std::size_t i = 1; i < samples.size(); ++i) {
        const SpectralSample& a = samples[i - 1];
        const SpectralSample& b = samples[i];
        const double width = b.nanometres - a.nanometres;
        if (!(width > 0)) continue;
        const int steps = static_cast<int>(std::clamp(std::ceil(width), 1.0, 1000.0));
        for (int k = 0; k < steps; ++k) {
            const double x = (k + 0.5) / steps;
            sum +=
                (a.weight + x * (b.weight - a.weight)) * (width / steps) * cie_xyz(a.nanometres + x * width);
        }
    }
    return sum;
}

Rgb xyz_to_rgb(const V3d& c) {
    return {static_cast<float>(3.240479 * c.x - 1.537150 * c.y - 0.498535 * c.z),
            static_cast<float>(-0.969256 * c.x + 1.875992 * c.y + 0.041556 * c.z),
            static_cast<float>(0.055648 * c.x - 0.204043 * c.y + 1.057311 * c.z)};
}

V3d rgb_to_xyz(const Rgb& c) {
    const double r = double{c.x}, g = double{c.y}, b = double{c.z};
    return {0.412453 * r + 0.357580 * g + 0.180423 * b, 0.212671 * r + 0.715160 * g + 0.072169 * b,
            0.019334 * r + 0.119193 * g + 0.950227 * b};
}

Rgb colour_of_luminance_one(const Rgb& c) {
    const float y = luminance(c);
    if (!is_finite(c) || !(y > 0)) return Rgb(1);
    Rgb unit = c / y;
    if (!is_finite(unit)) return Rgb(1);
    const float least = std::min({unit.x, unit.y, unit.z});
    if (least < 0) unit = Rgb(1) + (unit - Rgb(1)) / (1 - least);  // the least component becomes 0
    unit = {std::max(0.0F, unit.x), std::max(0.0F, unit.y), std::max(0.0F, unit.z)};
    return unit / luminance(unit);  // about 1 already; takes the rounding out
}

}  // namespace lucerna
