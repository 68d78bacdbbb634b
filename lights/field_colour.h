// What colour the light of a light field has where a particle is drawn or a ray finds it.
//
// A field is sampled by its channel W (light_field.h). Light of W > 0 has the colour (X, Y, Z) / W at the
// same place of the same pixel, each quotient cut to what it is where no coefficient is negative, [0,
// 1/weight].
//
// Renders have linear sRGB, which does not hold every lamp's colours: a chip of 450 nm is (2.4, -3.4, 40.4)
// per luminance. Mixed with grey place by place, a white LED would come out yellow. So negative components
// are left out, and each component is scaled so that all the light together has the colour that was measured
// of the whole lamp, which is in the gamut or mixed with grey as a whole. Particles, sample_Li and Le speak
// of one lamp.
#pragma once

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldColour {
  public:
    // Of a field with one colour: that one, everywhere. Of others two sums over all cells are made.
    FieldColour(const LightField& field, const Workers& workers);

    // Linear sRGB of light by its W, X and Z, per unit of W, no component negative. Of a field of several
    // colours; w > 0. Its mean over the field, weighted by W, is mean().
    Rgb of(float w, float x, float z) const { return gain_ * shown(w, x, z); }
    // Of all the light that is emitted: luminance 1.
    const Rgb& mean() const { return mean_; }

  private:
    // Before each component is scaled.
    Rgb shown(float w, float x, float z) const {
        const float y = (w - weight_.x * x - weight_.z * z) / weight_.y;  // > 0: ColourChannels
        const float share_x = std::min(std::max(x / w, 0.0F), most_.x);
        const float share_y = std::min(std::max(y / w, 0.0F), most_.y);
        const float share_z = std::min(std::max(z / w, 0.0F), most_.z);
        // xyz_to_rgb() in single precision, for particles by the million.
        return {std::max(0.0F, 3.24048134F * share_x - 1.53715152F * share_y - 0.49853633F * share_z),
                std::max(0.0F, -0.96925495F * share_x + 1.87599000F * share_y + 0.04155593F * share_z),
                std::max(0.0F, 0.05564664F * share_x - 0.20404134F * share_y + 1.05731107F * share_z)};
    }

    V3f weight_{0, 1, 0}, most_{0, 1, 0};
    Rgb gain_{1.0F}, mean_{1.0F};
};

}  // namespace lucerna
