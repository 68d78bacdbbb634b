// Slide projectors shared by several tests.
#pragma once

#include "lights/measurement/acquire.h"

namespace lucerna::testing {

// Returns a projector with a lens of 25 mm, focused at 0.6 m.
inline Projector small_projector() {
    Projector p;
    p.aperture = 0.025;
    p.focal_length = 0.059;
    p.focus = 0.6;
    p.setback = 0.02;
    p.slide_size = {0.036, 0.024};
    p.flux = 1000;
    return p;
}

}  // namespace lucerna::testing
