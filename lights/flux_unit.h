// What light is counted in: radiometric or photometric units.
//
// Measured lamps come in either, as their files say; a scene may state one unit for all of its light
// (engine/pbrt, Option "unit"). From watts to lumens leads the luminous efficacy of the lamp's radiation,
//
//     K = 683 lm/W · ∫ Φ(λ) V(λ) dλ / ∫ Φ(λ) dλ
//
// which only its spectrum tells [CIE 018:2019]: light that is three channels, or one number, does not know
// it.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "engine/base/error.h"

namespace lucerna {

enum class FluxUnit : std::uint8_t { watt, lumen };

inline std::string_view flux_unit_name(FluxUnit unit) {
    return unit == FluxUnit::watt ? "W" : "lm";
}

// "photometric": all light counts in lumens; "radiometric": in watts. None for another name.
inline std::optional<FluxUnit> unit_named(std::string_view name) {
    if (name == "photometric") return FluxUnit::lumen;
    if (name == "radiometric") return FluxUnit::watt;
    return std::nullopt;
}
inline std::string_view unit_name(FluxUnit unit) {
    return unit == FluxUnit::lumen ? "photometric" : "radiometric";
}

// Of light of 555 nm, by the definition of the lumen; no other light has more.
inline constexpr double kMostLumensPerWatt = 683.002;

// How a measured lamp is brought to the unit of its scene.
struct LampUnit {
    std::optional<FluxUnit> wanted = {};  // the scene's; none: the lamp keeps its own
    double efficacy = 0;                  // lm/W, as the scene says; 0: as the lamp's file says

    FluxUnit taken(FluxUnit own) const { return wanted.value_or(own); }
};

// What a flux in the lamp's own unit is multiplied by. `efficacy_of_file` in lm/W, 0: the file says none.
// Throws InputError at `at` if the units differ and no efficacy is known, naming what is accepted.
double unit_factor(const LampUnit& unit, FluxUnit own, double efficacy_of_file, const Location& at);

}  // namespace lucerna
