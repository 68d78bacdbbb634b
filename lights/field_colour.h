// The colour of a light field's emission where a particle is drawn or a ray meets the lamp.
//
// A field is sampled by its channel W (light_field.h). Light of W > 0 has the colour (X, Y, Z) / W at the
// same place of the same pixel. Each quotient is clamped to its range for nonnegative coefficients, [0,
// 1/weight].
//
// Renders are in linear sRGB unless a wider space is chosen (working_space.h). sRGB does not hold every
// lamp's colours: a chip of 450 nm is (2.4, -3.4, 40.4) per luminance. Mixing with grey at each place would
// make a white LED yellow. Instead, negative components are set to 0 and each component is scaled so that the
// total light has the measured colour of the whole lamp, which is in the gamut or is mixed with grey as a
// whole. Particles, sample_Li and Le thus agree on one lamp.
#pragma once

#include <array>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldColour {
  public:
    // A field of one colour has that colour everywhere. Other fields need two sums over all cells.
    FieldColour(const LightField& field, const Workers& workers, const WorkingSpace& colours = {});

    // Returns the emission in the working space per unit of W, from its W, X and Z; no component is negative.
    // Requires a field of several colours and w > 0. Its mean over the field, weighted by W, is mean().
    Rgb of(float w, float x, float z) const { return gain_ * shown(w, x, z); }
    // Returns the mean colour of all emitted light, which has luminance 1.
    const Rgb& mean() const { return mean_; }

  private:
    // Returns the colour before each component is scaled.
    Rgb shown(float w, float x, float z) const {
        const float y = (w - weight_.x * x - weight_.z * z) / weight_.y;  // the weight is > 0: ColourChannels
        const float share_x = std::min(std::max(x / w, 0.0F), most_.x);
        const float share_y = std::min(std::max(y / w, 0.0F), most_.y);
        const float share_z = std::min(std::max(z / w, 0.0F), most_.z);
        // Single precision suffices, and particles need it by the million.
        const auto component = [&](const V3f& row) {
            return std::max(0.0F, row.x * share_x - row.y * share_y + row.z * share_z);
        };
        return {component(rows_[0]), component(rows_[1]), component(rows_[2])};
    }

    std::array<V3f, 3> rows_;  // from XYZ to the working space; each second entry is subtracted
    V3f weight_{0, 1, 0}, most_{0, 1, 0};
    Rgb gain_{1.0F}, mean_{1.0F};
};

}  // namespace lucerna
