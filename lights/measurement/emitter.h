// A lamp described by a formula: a flat emitter whose radiance is known for every ray.
#pragma once

#include <cstdint>
#include <functional>

#include "engine/base/vec.h"
#include "lights/light_field.h"

namespace lucerna {

// A flat emitter on a plane parallel to S, centred on the axis. Nothing leaves outside its outline.
struct EmitterModel {
    enum class Outline : std::uint8_t { disc, rectangle } outline = Outline::disc;
    V2d half_size{0, 0};  // metres; of a disc, x is the radius
    double setback = 0;   // metres by which the emitter lies behind S, >= 0
    // Radiance in flux unit / (m² sr) at a point of the emitter (metres from its centre) along a unit
    // direction with d.z > 0. Should be smooth within the outline: edges are integrated over only where the
    // outline has them. Safe to call from many threads.
    std::function<double(const V2d& position, const V3d& direction)> radiance;
    double flux = 0;      // in total, flux unit
    LightFieldInfo info;  // colour, unit and provenance to pass on
};

// Intensity ∝ cos^exponent θ, that is radiance ∝ cos^(exponent - 1) θ: 1 is Lambertian, larger is narrower;
// >= 1. `pattern`, if given, multiplies the radiance over the emitter: a function >= 0 on [-1, 1]²,
// normalised so that the emitter's flux is `flux`. Throws InputError for sizes, flux or exponents out of
// range.
EmitterModel cosine_emitter(EmitterModel::Outline outline, const V2d& half_size, double flux,
                            double exponent = 1, std::function<double(const V2d&)> pattern = {});

}  // namespace lucerna
