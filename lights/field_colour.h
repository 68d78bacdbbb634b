// What colour the light of a light field has where a particle is drawn or a ray finds it.
//
// A field is sampled by its channel W (light_field.h). Light of W > 0 has the colour (X, Y, Z) / W at the
// same place of the same pixel, each quotient cut to what it is where no coefficient is negative, [0,
// 1/weight].
//
// Renders are in linear sRGB unless a wider space is asked for (working_space.h). It does not hold every
// lamp's colours: a chip of 450 nm is (2.4, -3.4, 40.4) per luminance. Mixed with grey place by place, a
// white LED would come out yellow. So negative components are left out, and each component is scaled so that
// all the light together has the colour that was measured of the whole lamp, which is in the gamut or mixed
// with grey as a whole. Particles, sample_Li and Le speak of one lamp.
#pragma once

#include <array>

#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "engine/colour/working_space.h"
#include "lights/light_field.h"

namespace lucerna {

class FieldColour {
  public:
    // Of a field with one colour: that one, everywhere. Of others two sums over all cells are made.
    FieldColour(const LightField& field, const Workers& workers, const WorkingSpace& colours = {});

    // Light of the working space by its W, X and Z, per unit of W, no component negative. Of a field of
    // several colours; w > 0. Its mean over the field, weighted by W, is mean().
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
        // In single precision, for particles by the million.
        const auto component = [&](const V3f& row) {
            return std::max(0.0F, row.x * share_x - row.y * share_y + row.z * share_z);
        };
        return {component(rows_[0]), component(rows_[1]), component(rows_[2])};
    }

    std::array<V3f, 3> rows_;  // from XYZ to light; the second of each is subtracted
    V3f weight_{0, 1, 0}, most_{0, 1, 0};
    Rgb gain_{1.0F}, mean_{1.0F};
};

}  // namespace lucerna
