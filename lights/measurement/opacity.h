// The measuring filter as a thing that can be printed: a film that lets through a share of the light.
//
// The dual Φ̃⊗Φ̃ with which a rig must weigh the light over a filter position is negative in places, and
// larger than 1 in others; a film's opacity is neither. So the filter is made twice, once of the dual's
// positive part and once of its negative part, each divided by its maximum; the two photographs are scaled
// back and subtracted [Goesele 2003, 4.2].
//
// Source: [Goesele 2003].
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lights/light_field.h"

namespace lucerna {

enum class FilterSign : std::uint8_t { positive, negative };

inline constexpr std::array<FilterSign, 2> kFilterSigns{FilterSign::positive, FilterSign::negative};

// The maximum of ±Φ̃⊗Φ̃ over Δ_u Δ_v [1/m²]: irradiance behind the film times this is the sign's part of E.
double filter_scale(const Rig& rig, FilterSign sign);

// What the film lets through at a place, in metres from the filter's centre: in [0, 1].
double filter_opacity(const Rig& rig, FilterSign sign, const V2d& from_centre);

// What the sensor sees behind the two films, at every filter position.
struct FilterImages {
    Rig rig;
    // Mean irradiance of each pixel [flux unit / m²], laid out as Rig::index says.
    std::vector<float> positive, negative;
    LightFieldInfo info;  // to pass on; captured and missed are not known yet
    double flux = 0;      // of the whole lamp, flux unit; 0 if nobody knows

    std::vector<float>& of(FilterSign sign) { return sign == FilterSign::positive ? positive : negative; }
    const std::vector<float>& of(FilterSign sign) const {
        return sign == FilterSign::positive ? positive : negative;
    }
};

// E = scale⁺ I⁺ - scale⁻ I⁻. Captured is the field's flux, missed what is left of the lamp's (0 if that is
// not known). Throws InputError if the images are not of the rig or hold a number that is not finite.
LightField field_of(const FilterImages& images);

}  // namespace lucerna
