// A way into a light field: a lamp described by a formula, measured by a virtual rig.
//
// It does what the optical bench does: weighs the light with the dual bell Φ̃ over each filter position of S
// and with the box of each pixel on M [LF 2], by numerical integrals. A lamp known by its rays is projected
// by sums instead: ray_projection.h.
#pragma once

#include <functional>
#include <string>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/light_field.h"
#include "lights/opacity.h"

namespace lucerna {

// --- a lamp described by a formula
// --------------------------------------------------------------------------------

// A flat emitter on a plane parallel to S, centred on the axis. Nothing leaves outside its outline.
struct EmitterModel {
    enum class Outline : std::uint8_t { disc, rectangle } outline = Outline::disc;
    V2d half_size{0, 0};  // metres; of a disc, x is the radius
    double setback = 0;   // metres by which the emitter lies behind S, >= 0
    // Radiance in flux unit / (m² sr) at a point of the emitter (metres from its centre) along a unit
    // direction with d.z > 0. Should be smooth within the outline: edges are integrated over only where the
    // outline has them.
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

struct AcquireOptions {
    int s_nodes = 3;  // Gauss nodes per half filter spacing on S, 1 to 5
    int m_nodes =
        3;  // Gauss nodes per pixel and axis on M, 1 to 5; more than 1 also smooths the emitter's pattern
};

// What the rig's sensor sees behind the positive and the negative film. Throws InputError for a rig that is
// none, and when the user stops it.
FilterImages acquire_filters(const EmitterModel& emitter, const Rig& rig, const Workers& workers,
                             Monitor& monitor, const AcquireOptions& options = {});

// field_of(acquire_filters()): the light field that the rig would measure: E to about 1e-4 of its largest
// value for smooth radiance. captured + missed = the emitter's flux. Throws InputError for a rig that is
// none, and when the user stops it.
LightField acquire(const EmitterModel& emitter, const Rig& rig, const Workers& workers, Monitor& monitor,
                   const AcquireOptions& options = {});

}  // namespace lucerna
