#include "engine/base/tone.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "engine/base/spectrum.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 2> kCurves = {"neutral", "linear"};

constexpr double kLargest = double{std::numeric_limits<float>::max()};

// Neither NaN nor infinite.
double finite(float v) {
    if (std::isnan(v)) return 0;
    return std::isfinite(v) ? double{v} : std::copysign(kLargest, double{v});
}

V3d neutral(const V3d& c) {
    constexpr double kKnee = 0.8, kDesaturation = 0.15;
    const double peak = std::max({c.x, c.y, c.z});
    if (peak <= kKnee) return c;
    // 1 in the limit; continuous with slope 1 at the knee.
    const double shown = 1 - sqr(1 - kKnee) / (peak + 1 - 2 * kKnee);
    const double colour = 1 / (1 + kDesaturation * (peak - shown));
    return V3d(shown * (1 - colour)) + (shown / peak * colour) * c;
}

float code_of(double x) {
    const auto linear = static_cast<float>(x);
    return linear >= 1 ? 1 : srgb_encoded(linear);  // the formula misses 1 by a rounding
}

// Of a colour's luminance in its space.
V3d luminance_weights(const ColourSpace& space) {
    return {space.primaries[0].y, space.primaries[1].y, space.primaries[2].y};
}

// CIE XYZ, luminance 1. Planck's up to 4000 K, daylight from 5000 K, in between the mixture of both that
// makes them meet [CIE 224:2017].
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

// Luminances above 0 that are finite, in no order.
std::vector<float> luminances(const Image& image) {
    const V3d weights = luminance_weights(image.space ? *image.space : srgb());
    std::vector<float> all;
    all.reserve(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) {
            const Rgb c = image.rgb_at(x, y);
            if (!is_finite(c)) continue;
            const double value = std::min(weights.dot(V3d(c)), kLargest);
            if (value > 0) all.push_back(static_cast<float>(value));
        }
    }
    return all;
}

// The values below the largest share of them, at least one; reorders them.
std::span<float> without_largest(std::span<float> values, double share) {
    const auto kept = static_cast<std::size_t>(std::ceil((1 - share) * static_cast<double>(values.size())));
    const std::size_t last = std::max<std::size_t>(kept, 1) - 1;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(last), values.end());
    return values.first(last + 1);
}

// The factor by which the mean of min(1, factor * value) is `target`, in (0, 1). The mean is a concave
// function of the factor, of straight pieces: Newton's steps come from below and end on the right piece.
double factor_to_mean(std::span<const float> values, double target) {
    const double wanted = target * static_cast<double>(values.size());
    double factor = 0;
    while (true) {
        double sum = 0;
        std::size_t full = 0;
        for (const float value : values) {
            if (factor * double{value} < 1) {
                sum += double{value};
            } else {
                ++full;
            }
        }
        const double next = (wanted - static_cast<double>(full)) / sum;
        if (!(next > factor)) return factor;
        factor = next;
    }
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
    c = held_in_gamut(c, luminance_weights(srgb()));
    c = tone_mapped(c * double{look_.exposure}, look_.tone);
    return {code_of(c.x), code_of(c.y), code_of(c.z)};
}

Image displayed(const Image& image, const PictureLook& look) {
    const Display display(look, image.space);
    Image picture = Image::rgb(image.width, image.height);
    for (int y = 0; y < image.height; ++y) {
        for (int x = 0; x < image.width; ++x) picture.set_rgb(x, y, display(image.rgb_at(x, y)));
    }
    return picture;
}

float auto_exposure(const Image& image) {
    constexpr double kMiddleGrey = 0.18, kBright = 0.01, kBlack = 0x1p-12, kGlaring = 0.05;
    std::vector<float> all = luminances(image);
    if (all.empty()) return 1;
    const double black = kBlack * double{without_largest(all, kBright).back()};
    std::erase_if(all, [black](float value) { return double{value} < black; });
    const double factor = factor_to_mean(without_largest(all, kGlaring), kMiddleGrey);
    // Of images that are nearly black or nearly infinite, too, a number that a float can hold and divide by.
    return static_cast<float>(std::clamp(factor, 0x1p-126, 0x1p126));
}

}  // namespace lucerna
