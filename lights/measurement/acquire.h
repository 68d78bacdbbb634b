// A way into a light field: a lamp described by a formula, measured by a virtual rig.
//
// It does what the optical bench does: weighs the light with the dual bell Φ̃ over each filter position of S
// and with the box of each pixel on M [Goesele 2003, 3.1], by numerical integrals. A lamp known by its rays
// is projected by sums instead: ray_projection.h.
#pragma once

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/base/vec.h"
#include "lights/light_field.h"
#include "lights/measurement/emitter.h"
#include "lights/measurement/opacity.h"

namespace lucerna {

class AcquirePart;

struct AcquireOptions {
    int s_nodes = 3;  // Gauss nodes per half filter spacing on S, 1 to 5
    int m_nodes = 3;  // Gauss nodes per pixel and axis on M, 1 to 5; they smooth the emitter's pattern, too
    // Where finished work is kept and taken up again; may be null. Of the same emitter, rig and nodes.
    AcquirePart* part = nullptr;
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
