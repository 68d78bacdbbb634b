#include "engine/colour/chromaticity.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "engine/base/elementary.h"
#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

struct Uv {  // CIE 1960
    double u, v;
};

Uv uv_of(const V3d& xyz) {
    const Chromaticity c = chromaticity(xyz);
    return {c.u, c.v * 2 / 3};
}

// Returns the chromaticity of the black body of `mired` reciprocal megakelvins, in which the locus has even
// steps.
Uv locus(double mired) {
    return uv_of(spectrum_to_xyz(blackbody_spectrum(1e6 / mired)));
}

// The search begins at even steps of mireds.
constexpr double kLowMired = 1e6 / kMostKelvin, kHighMired = 1e6 / kLeastKelvin;
constexpr int kLocusSteps = 100;
double mired_at(int step) {
    return kLowMired + (kHighMired - kLowMired) * step / kLocusSteps;
}
// Returns the locus at these steps, which is computed once.
const std::array<Uv, kLocusSteps + 1>& locus_at_steps() {
    static const auto all = [] {
        std::array<Uv, kLocusSteps + 1> made;
        for (int step = 0; step <= kLocusSteps; ++step)
            made[static_cast<std::size_t>(step)] = locus(mired_at(step));
        return made;
    }();
    return all;
}

// Returns the mired between `low` and `high` at which `value` is least, by golden section search, if it has
// no other minimum.
template <typename F>
double least(double low, double high, double accuracy, F&& value) {
    constexpr double kGolden = 0.6180339887498949;
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = value(a), at_b = value(b);
    while (high - low > accuracy) {
        if (at_a < at_b) {
            high = b;
            b = a, at_b = at_a;
            a = high - kGolden * (high - low), at_a = value(a);
        } else {
            low = a;
            a = b, at_a = at_b;
            b = low + kGolden * (high - low), at_b = value(b);
        }
    }
    return 0.5 * (low + high);
}

}  // namespace

Chromaticity chromaticity(const V3d& xyz) {
    const double sum = xyz.x + xyz.y + xyz.z, prime = xyz.x + 15 * xyz.y + 3 * xyz.z;
    return {xyz.x / sum, xyz.y / sum, 4 * xyz.x / prime, 9 * xyz.y / prime};
}

std::optional<ColourTemperature> colour_temperature(const V3d& xyz) {
    const double sum = xyz.x + xyz.y + xyz.z;
    if (!(sum > 0) || !std::isfinite(sum)) return std::nullopt;
    const Uv at = uv_of(xyz);
    const auto distance_to = [&at](const Uv& body) { return hypot(at.u - body.u, at.v - body.v); };
    const auto distance = [&](double mired) { return distance_to(locus(mired)); };
    // Coarse steps come first: the locus bends, and a colour on its concave side may have two nearest points.
    int nearest = 0;
    double nearest_distance = distance_to(locus_at_steps()[0]);
    for (int step = 1; step <= kLocusSteps; ++step) {
        const double here = distance_to(locus_at_steps()[static_cast<std::size_t>(step)]);
        if (here < nearest_distance) nearest = step, nearest_distance = here;
    }
    const double low = mired_at(std::max(0, nearest - 1)),
                 high = mired_at(std::min(kLocusSteps, nearest + 1));
    constexpr double kAccuracy = 1e-4;  // mired; near the minimum the distance resolves no finer
    const double mired = least(low, high, kAccuracy, distance);
    if (mired - kLowMired < 2 * kAccuracy || kHighMired - mired < 2 * kAccuracy) return std::nullopt;
    const double away = distance(mired);
    if (away > kMostDuv) return std::nullopt;
    return ColourTemperature{1e6 / mired, at.v < locus(mired).v ? -away : away};
}

}  // namespace lucerna
