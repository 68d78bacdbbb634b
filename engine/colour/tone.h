// Converts an image into a picture: white balance, exposure, tone curve, sRGB. See
// docs/explanation/pictures.md.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "engine/base/vec.h"
#include "engine/colour/colour_space.h"

namespace lucerna {

// "neutral" is exact up to 0.8 of white; brighter colours roll off to white and keep their hue. "linear" is
// exact up to white, where each channel is clipped.
enum class ToneCurve { neutral, linear };

std::span<const std::string_view> tone_curve_names();
std::optional<ToneCurve> tone_curve_named(std::string_view name);

struct PictureLook {
    float exposure = 1;  // factor of radiance; radiance 1/exposure is white
    ToneCurve tone = ToneCurve::neutral;
    // Holds the correlated colour temperature, in kelvins from kLeastWhite to kMostWhite, of the light whose
    // white is shown as the display's white. None means D65, with which colours do not change.
    std::optional<double> white = std::nullopt;
};
inline constexpr double kLeastWhite = 1000, kMostWhite = 25000;

// Maps linear sRGB with white at 1, no component negative, to linear sRGB in [0, 1].
//
// neutral is the curve of Khronos PBR Neutral [Khronos 2024] without its offset: with p the largest component
// and q = 1 - 0.04 / (p - 0.6) where p > 0.8, the colour times q/p is mixed with the grey q, whose share is 1
// - 1 / (1 + 0.15 (p - q)). The offset, which subtracts up to 0.04 from all components, stands for a
// dielectric's reflection of a white studio; simulated light has no such part.
V3d tone_mapped(const V3d& c, ToneCurve curve);

// Returns Bradford's adaptation [Lam 1985] of linear sRGB from the white of a correlated colour temperature
// to D65. It keeps the luminance of the white.
RgbMatrix white_balance(double kelvin);

// Converts radiance in a colour space to a display's encoded sRGB in [0, 1].
class Display {
  public:
    // `space` is as in Image: null means linear sRGB. It must outlive the display.
    explicit Display(const PictureLook& look, const ColourSpace* space = nullptr);

    // NaN in a component counts as 0, infinity as the largest number. Colours outside sRGB's gamut are mixed
    // with grey of their luminance.
    Rgb operator()(const Rgb& radiance) const;

  private:
    PictureLook look_;
    std::optional<RgbMatrix> to_srgb_;  // none: the components are shown as they are
};

}  // namespace lucerna
