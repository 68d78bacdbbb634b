// What a lamp's file counts its light in.
#pragma once

#include <cstdint>
#include <string_view>

namespace lucerna {

enum class FluxUnit : std::uint8_t { watt, lumen };

inline std::string_view flux_unit_name(FluxUnit unit) {
    return unit == FluxUnit::watt ? "W" : "lm";
}

// Of light of 555 nm, by the definition of the lumen; no other light has more.
inline constexpr double kMostLumensPerWatt = 683.002;

}  // namespace lucerna
