#include "engine/colour/tone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "engine/colour/spectrum.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 2> kCurves = {"neutral", "linear"};

constexpr double kLargest = double{std::numeric_limits<float>::max()};

// Replaces NaN by 0, and infinity by the largest float.
double finite(float v) {
    if (std::isnan(v)) return 0;
    return std::isfinite(v) ? double{v} : std::copysign(kLargest, double{v});
}

V3d neutral(const V3d& c) {
    constexpr double kKnee = 0.8, kDesaturation = 0.15;
    const double peak = std::max({c.x, c.y, c.z});
    if (peak <= kKnee) return c;
    // The value is 1 in the limit, and continuous with slope 1 at the knee.
    const double shown = 1 - sqr(1 - kKnee) / (peak + 1 - 2 * kKnee);
    const double colour = 1 / (1 + kDesaturation * (peak - shown));
    return V3d(shown * (1 - colour)) + (shown / peak * colour) * c;
}

float code_of(double x) {
    const auto linear = static_cast<float>(x);
    return linear >= 1 ? 1 : srgb_encoded(linear);  // rounding keeps the formula from reaching 1
}

// Returns white as CIE XYZ with luminance 1: Planck's law up to 4000 K, daylight from 5000 K, and in between
// the mixture of both that joins them [CIE 224:2017].
V3d white_of(double kelvin) {
    constexpr double kPlanckian = 4000, kDaylightAlone = 5000;
    V3d white(0);
    const double daylight = std::clamp((kelvin - kPlanckian) / (kDaylightAlone - kPlanckian), 0.0, 1.0);
    if (daylight < 1) {
        const V3d xyz = spectrum_to_xyz(blackbody_spectrum(kelvin));
        white += (1 - daylight) / xyz.y * xyz;
    }
    if (daylight > 0) {
        const V3d xyz = spectrum_to_xyz(daylight_spectrum(kelvin));
        white += daylight / xyz.y * xyz;
    }
    return white;
}

const ColourSpace& srgb() {
    return colour_spaces().front();
}

}  // namespace

std::span<const std::string_view> tone_curve_names() {
    return kCurves;
}

std::optional<ToneCurve> tone_curve_named(std::string_view name) {
    const auto found = std::ranges::find(kCurves, name);
    if (found == kCurves.end()) return std::nullopt;
    return static_cast<ToneCurve>(found - kCurves.begin());
}

V3d tone_mapped(const V3d& c, ToneCurve curve) {
    if (curve == ToneCurve::neutral) return neutral(c);
    return {std::min(c.x, 1.0), std::min(c.y, 1.0), std::min(c.z, 1.0)};
}

RgbMatrix white_balance(double kelvin) {
    const V3d white = white_of(kelvin);
    RgbMatrix matrix;
    for (int c = 0; c < 3; ++c) {
        const V3d column =
            srgb().from_xyz(adapted_to_d65(srgb().primaries[static_cast<std::size_t>(c)], white));
        for (int r = 0; r < 3; ++r) matrix.rows[static_cast<std::size_t>(r)][c] = column[r];
    }
    return matrix;
}

Display::Display(const PictureLook& look, const ColourSpace* space) : look_(look) {
    if (space && space != &srgb()) to_srgb_ = conversion(*space, srgb());
    if (!look.white) return;
    const RgbMatrix balance = white_balance(*look.white);
    to_srgb_ = to_srgb_ ? balance * *to_srgb_ : balance;
}

Rgb Display::operator()(const Rgb& radiance) const {
    V3d c(finite(radiance.x), finite(radiance.y), finite(radiance.z));
    if (to_srgb_) c = *to_srgb_ * c;
    c = held_in_gamut(c, srgb().luminances());
    c = tone_mapped(c * double{look_.exposure}, look_.tone);
    return {code_of(c.x), code_of(c.y), code_of(c.z)};
}

}  // namespace lucerna
