// Defines what an image shows: the radiance that reaches the camera, or the illuminance of what it sees.
//
// For illuminance every pixel shows the reading E of a meter on the first visible surface, on its visible
// side. The integrator computes it with one change: it takes that first surface for a white Lambertian one,
// whose radiance L every method can compute, and E = π L. Light that this surface emits, or that lamps send
// into the camera before it, is no part of E.
//
// Lights are in W or in lm, as the scene states for all of them or each light by itself, and so is the image.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "engine/base/vec.h"
#include "engine/scene/bsdf.h"
#include "engine/scene/scene.h"
#include "lights/flux_unit.h"

namespace lucerna {

enum class Quantity : std::uint8_t { radiance, illuminance };

// Returns the white surface of a meter at `hit`.
inline Bsdf white_receiver(const Hit& hit) {
    return Bsdf(DiffuseLobe{Rgb(1.0F)}, hit.ns, hit.at.n, hit.dpdu);
}

// Returns the meter's reading E [flux unit/m²] for the radiance L of a white receiver.
inline Rgb meter_reading(const Rgb& radiance) {
    return radiance * kPi;
}

// Returns the unit of all lights that shine; W if there are none, and none if they differ.
inline std::optional<FluxUnit> common_unit(std::span<const std::unique_ptr<Light>> lights) {
    std::optional<FluxUnit> unit;
    for (const auto& light : lights) {
        if (!(light->power() > 0)) continue;
        if (unit && *unit != light->unit()) return std::nullopt;
        unit = light->unit();
    }
    return unit.value_or(FluxUnit::watt);
}

// Returns the unit of the scene's images; none if mixed. A stated unit also holds for emission of media.
inline std::optional<FluxUnit> scene_unit(const Scene& scene) {
    return scene.stated_unit() ? scene.stated_unit() : common_unit(scene.lights());
}

// Returns "cd/m^2", "W/(m^2 sr)", "lx" or "W/m^2", or a text that says that units are mixed.
inline std::string unit_text(Quantity quantity, std::optional<FluxUnit> unit) {
    if (!unit) return "mixed (some lights in W, some in lm)";
    const bool photometric = *unit == FluxUnit::lumen;
    if (quantity == Quantity::illuminance) return photometric ? "lx" : "W/m^2";
    return photometric ? "cd/m^2" : "W/(m^2 sr)";
}
// Returns the unit of light paths' fluxes: "W" or "lm".
inline std::string flux_unit_text(std::optional<FluxUnit> unit) {
    return unit ? std::string(flux_unit_name(*unit)) : unit_text(Quantity::radiance, unit);
}

}  // namespace lucerna
