// The unit in which light is counted: radiometric or photometric.
//
// Measured lamps come in either unit, as their files state; a scene may state one unit for all of its light
// (engine/pbrt, Option "unit"). Watts are converted to lumens by the luminous efficacy of the lamp's
// radiation,
//
//     K = 683 lm/W · ∫ Φ(λ) V(λ) dλ / ∫ Φ(λ) dλ
//
// which follows only from its spectrum [CIE 018:2019], not from three channels or a single number.
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

// Returns lumens for "photometric", watts for "radiometric" and none for any other name.
inline std::optional<FluxUnit> unit_named(std::string_view name) {
    if (name == "photometric") return FluxUnit::lumen;
    if (name == "radiometric") return FluxUnit::watt;
    return std::nullopt;
}
inline std::string_view unit_name(FluxUnit unit) {
    return unit == FluxUnit::lumen ? "photometric" : "radiometric";
}

// The efficacy of light of 555 nm, by the definition of the lumen. No other light exceeds it.
inline constexpr double kMostLumensPerWatt = 683.002;
// The same, rounded: Km of the CIE, by which its table of V(λ) gives lumens.
inline constexpr double kLumensPerWatt = 683;

// Says how a measured lamp is brought to the unit of its scene.
struct LampUnit {
    std::optional<FluxUnit> wanted = {};  // the scene's unit; none: the lamp keeps its own
    double efficacy = 0;                  // lm/W as the scene states it; 0: as the lamp's file states it

    FluxUnit taken(FluxUnit own) const { return wanted.value_or(own); }
};

// Returns the factor for a flux in the lamp's own unit. `efficacy_of_file` is in lm/W; 0 means that the file
// states none. Throws InputError at `at`, naming what is accepted, if the units differ and no efficacy is
// known.
double unit_factor(const LampUnit& unit, FluxUnit own, double efficacy_of_file, const Location& at);

}  // namespace lucerna
