// How an image becomes a picture: white balance, exposure, tone curve, sRGB. What is shown and why:
// docs/explanation/pictures.md.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"
#include "engine/colour/colour_space.h"

namespace lucerna {

// "neutral": exact up to 0.8 of white; brighter colours roll off to white and keep their hue. "linear": exact
// up to white, where each channel is clipped.
enum class ToneCurve { neutral, linear };

std::span<const std::string_view> tone_curve_names();
std::optional<ToneCurve> tone_curve_named(std::string_view name);

struct PictureLook {
    float exposure = 1;  // of radiance; radiance 1/exposure is white
    ToneCurve tone = ToneCurve::neutral;
    // The white of light of this correlated colour temperature, in kelvins from kLeastWhite to kMostWhite, is
    // shown as the display's. None: D65 is, and no colour changes.
    std::optional<double> white = std::nullopt;
};
inline constexpr double kLeastWhite = 1000, kMostWhite = 25000;

// Linear sRGB with white at 1, no component negative, to linear sRGB in [0, 1].
//
// neutral is the curve of Khronos PBR Neutral [Khronos 2024] without its offset: with p the largest component
// and q = 1 - 0.04 / (p - 0.6) where p > 0.8, the colour times q/p is mixed with the grey q, whose share is
// 1 - 1 / (1 + 0.15 (p - q)). The offset, which takes up to 0.04 off all components, stands for what a
// dielectric reflects of a white studio; light that is computed has no such part.
V3d tone_mapped(const V3d& c, ToneCurve curve);

// From the light that a correlated colour temperature's white makes of each linear sRGB colour to that of
// D65: Bradford's adaptation [Lam 1985], which keeps the luminance of the white.
RgbMatrix white_balance(double kelvin);

// What a display is given for radiance in a colour space: sRGB in [0, 1], encoded.
class Display {
  public:
    // `space` as in Image: null is linear sRGB. It must outlive the display.
    explicit Display(const PictureLook& look, const ColourSpace* space = nullptr);

    // NaN in a component counts as 0, infinity as the largest number. What is outside sRGB's gamut is mixed
    // with grey of its luminance.
    Rgb operator()(const Rgb& radiance) const;

  private:
    PictureLook look_;
    std::optional<RgbMatrix> to_srgb_;  // none: the components are shown as they are
};

}  // namespace lucerna
