// A slide projector: a slide, lit evenly from behind, and a thin lens that throws its picture.
//
// The lens stands at distance a behind which the slide lies, and makes it sharp on a plane at distance b,
// 1/a + 1/b = 1/f. A ray that leaves the lens at p along d pierces the sharp plane at q = p + d b/d_z; it
// comes from the slide's point -q a/b and has the radiance that the slide lets through there. So the picture
// stands upright, with q_x to the right and q_y up, for someone who looks at the lens from the screen's far
// side: as every image of this project shows a screen.
#pragma once

#include "engine/base/image.h"
#include "lights/measurement/emitter.h"

namespace lucerna {

struct Projector {
    double aperture = 0;      // radius of the lens, metres
    double focal_length = 0;  // metres
    double focus = 0;         // b, from the lens to the sharp plane, metres; > focal_length
    double setback = 0;       // of the lens behind S, metres
    V2d slide_size{0, 0};     // metres
    bool inverted = false;    // the slide lets through 1 - its picture's value
    double flux = 0;          // that leaves the lens, in the unit of the emitter's info

    double slide_distance() const { return 1 / (1 / focal_length - 1 / focus); }  // a
    double magnification() const { return focus / slide_distance(); }             // b / a
};

// `picture` holds what the slide lets through, luminances in [0, 1], top row first; what lies beside the
// slide is dark. Throws InputError for lengths that are none, a picture out of range, or one without light.
EmitterModel projector_emitter(const Projector& projector, const Image& picture);

}  // namespace lucerna
