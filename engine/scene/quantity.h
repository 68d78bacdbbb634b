// What an image shows: the radiance that reaches the camera, or the light that arrives where it looks.
//
// For illuminance every pixel shows what a meter would read that lies on the first surface seen, on the side
// seen: E. It is computed by the integrator at hand, with one change: that first surface is a white
// Lambertian one, of which every method knows the radiance L, and E = π L. Light that this surface emits, or
// that lamps send into the camera before it, is no part of E.
//
// Units: lights count in W or in lm, as the scene states for all of them or each by itself; and so does the
// image.
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

// The surface of a meter where `hit` is.
inline Bsdf white_receiver(const Hit& hit) {
    return Bsdf(DiffuseLobe{Rgb(1.0F)}, hit.ns, hit.at.n, hit.dpdu);
}

// What the meter reads: E [flux unit/m²] from the radiance L of a white receiver.
inline Rgb meter_reading(const Rgb& radiance) {
    return radiance * kPi;
}

// The unit in which all lights that shine count; W if none does, and none if they differ.
inline std::optional<FluxUnit> common_unit(std::span<const std::unique_ptr<Light>> lights) {
    std::optional<FluxUnit> unit;
    for (const auto& light : lights) {
        if (!(light->power() > 0)) continue;
        if (unit && *unit != light->unit()) return std::nullopt;
        unit = light->unit();
    }
    return unit.value_or(FluxUnit::watt);
}

// That the scene's images are in; none if it is mixed. A stated unit holds for what media emit, too.
inline std::optional<FluxUnit> scene_unit(const Scene& scene) {
    return scene.stated_unit() ? scene.stated_unit() : common_unit(scene.lights());
}

// "cd/m^2", "W/(m^2 sr)", "lx", "W/m^2"; a mixture says so.
inline std::string unit_text(Quantity quantity, std::optional<FluxUnit> unit) {
    if (!unit) return "mixed (some lights in W, some in lm)";
    const bool photometric = *unit == FluxUnit::lumen;
    if (quantity == Quantity::illuminance) return photometric ? "lx" : "W/m^2";
    return photometric ? "cd/m^2" : "W/(m^2 sr)";
}
// Of energies of light paths: "W", "lm".
inline std::string flux_unit_text(std::optional<FluxUnit> unit) {
    return unit ? std::string(flux_unit_name(*unit)) : unit_text(Quantity::radiance, unit);
}

}  // namespace lucerna
