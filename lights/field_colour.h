// What colour the light of a light field has where a particle is drawn or a ray finds it.
//
// A field is sampled by its channel W (light_field.h). Light of W > 0 has the colour (X, Y, Z) / W at the
// same place of the same pixel, each quotient cut to what it is where no coefficient is negative, [0,
// 1/weight]; and each channel is scaled so that all the light together has the flux that was measured of it.
// So particles, sample_Li and Le speak of one lamp, and a channel's expectation is right although its
// coefficients may be negative. Colours that linear sRGB does not hold are mixed with grey of their
// luminance.
#pragma once

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldColour {
  public:
    // Of a field with one colour: that one, everywhere. Of others two sums over all cells are made.
    FieldColour(const LightField& field, const Workers& workers);

    // Linear sRGB of light by its W, X and Z. Of a field of several colours; w > 0. Its luminance is 1 in the
    // mean over the field, weighted by W.
    Rgb of(float w, float x, float z) const {
        const float y = (w - weight_.x * x - weight_.z * z) / weight_.y;  // > 0: ColourChannels
        const V3f xyz(std::min(std::max(x / w, 0.0F), most_.x) * gain_.x,
                      std::min(std::max(y / w, 0.0F), most_.y) * gain_.y,
                      std::min(std::max(z / w, 0.0F), most_.z) * gain_.z);
        return within_gamut(xyz);
    }
    // Of all the light that is emitted: luminance 1.
    const Rgb& mean() const { return mean_; }

  private:
    Rgb within_gamut(const V3f& xyz) const;

    V3f weight_{0, 1, 0}, most_{0, 1, 0}, gain_{1, 1, 1};
    Rgb mean_{1.0F};
};

// Linear sRGB, mixed with grey of the same luminance until no component is negative.
inline Rgb FieldColour::within_gamut(const V3f& xyz) const {
    // xyz_to_rgb() in single precision, for particles by the million.
    const Rgb c(3.24048134F * xyz.x - 1.53715152F * xyz.y - 0.49853633F * xyz.z,
                -0.96925495F * xyz.x + 1.87599000F * xyz.y + 0.04155593F * xyz.z,
                0.05564664F * xyz.x - 0.20404134F * xyz.y + 1.05731107F * xyz.z);
    const float least = std::min(c.x, std::min(c.y, c.z));
    const float share = least < 0 ? xyz.y / (xyz.y - least) : 1.0F;  // y >= 0: within [0, 1)
    return Rgb(xyz.y) + share * (c - Rgb(xyz.y));
}

}  // namespace lucerna
